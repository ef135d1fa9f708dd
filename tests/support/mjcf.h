#pragma once

#include <string>
#include <vector>

#include "models/mechanism.h"

namespace sysid {

// The mechanism as MJCF text: bodies l1, l2, ... with joints j1, j2, ... in the
// numbering of Mechanism::links and joints[i - 1]; nominal parameters,
// Joint::damping and friction, and per joint the armature (empty: none).
// Contacts off.
std::string ToMjcf(const Mechanism& mechanism,
                   const std::vector<double>& armature);

}  // namespace sysid
