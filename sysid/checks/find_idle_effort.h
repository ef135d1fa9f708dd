#pragma once

#include <vector>

#include "sysid/checks/as_read.h"

namespace sysid {

// Appends the efforts that do no work on the motion: the recorded effort tau
// turned into a tau, the gain a is estimated by (C.1) with the bodies as the
// model has them (masses that are free would make up for any gain). It is idle
// where a is zero, and known well enough that one is excluded; and where all of
// the user's freedoms do no better with it than without. Whether one was found.
bool FindIdleEffort(const AsRead& as_read, std::vector<Finding>* findings);

}  // namespace sysid
