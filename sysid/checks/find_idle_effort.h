#pragma once

#include <vector>

#include "sysid/checks/as_read.h"

namespace sysid {

// Appends the efforts that do no work on the motion: the recorded effort tau
// turned into a tau, the gain a is estimated by (C.1) on short segments (what
// really moved the mechanism is unknown, and longer ones go astray) with the
// bodies as the model has them (masses that are free would make up for any
// gain). The one whose gain mends most is idle where a is zero, known well
// enough that one is excluded, and the model does as well without it; then the
// others are asked without it. Whether one was found.
bool FindIdleEffort(const AsRead& as_read, std::vector<Finding>* findings);

}  // namespace sysid
