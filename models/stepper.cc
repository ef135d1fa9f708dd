#include "models/stepper-impl.h"

namespace sysid {

#define SYSID_INSTANTIATE(T) template class Stepper<T>;
SYSID_FOR_EACH_SCALAR(SYSID_INSTANTIATE)
#undef SYSID_INSTANTIATE

}  // namespace sysid
