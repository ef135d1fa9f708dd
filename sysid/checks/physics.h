#pragma once

#include <vector>

#include "sysid/checks/check.h"

namespace sysid {

// What the physics says of the recordings: a quick fit of the model to an
// excerpt, and where that misses the noise by far, the same of every other
// reading. Appends the reading that explains what is missed, if there is one.
// See docs/checks.md for the criterion. True where the data as they were read
// are explained to the noise: then nothing that matters is wrong with them.
bool CheckPhysics(const CheckInput& input, std::vector<Finding>* findings);

}  // namespace sysid
