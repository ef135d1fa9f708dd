#include "models/dry_friction.h"

#include "models/dry_friction-impl.h"

namespace sysid {

#define SYSID_INSTANTIATE(T) \
  template bool RestOrSlip<T>(Workspace<T>*, const T*, const T*, const T*, T*);
SYSID_FOR_EACH_SCALAR(SYSID_INSTANTIATE)
#undef SYSID_INSTANTIATE

}  // namespace sysid
