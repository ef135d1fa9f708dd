#pragma once

#include <vector>

#include "sysid/checks/check.h"

namespace sysid {

// What the physics says of the recordings: a quick fit of the model to an
// excerpt, and where that misses the noise by far, the same of every other
// reading. Appends the reading that explains what is missed, if there is one.
// See docs/checks.md for the criterion. Returns the error of the data as they
// were read, in times the noise; NaN where there is no motion to ask, or none
// that is smooth.
double CheckPhysics(const CheckInput& input, std::vector<Finding>* findings);

}  // namespace sysid
