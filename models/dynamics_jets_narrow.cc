#include "models/dynamics-impl.h"

// Apart from doubles (dynamics.cc), which cost the compiler less and are
// optimised more, and from the wide Jets (dynamics_jets_wide.cc): together they
// would take g++ 1.5 GB.

namespace sysid {

SYSID_INSTANTIATE_DYNAMICS(Jet8)
SYSID_INSTANTIATE_DYNAMICS(Jet16)

}  // namespace sysid
