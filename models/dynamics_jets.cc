#include "models/dynamics-impl.h"

// Apart from doubles (dynamics.cc), which cost the compiler less and are
// optimised more.

namespace sysid {

SYSID_INSTANTIATE_DYNAMICS(Jet8)
SYSID_INSTANTIATE_DYNAMICS(Jet16)
SYSID_INSTANTIATE_DYNAMICS(Jet24)

}  // namespace sysid
