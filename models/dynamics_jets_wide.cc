#include "models/dynamics-impl.h"

namespace sysid {

SYSID_INSTANTIATE_DYNAMICS(Jet24)

}  // namespace sysid
