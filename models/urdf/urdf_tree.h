#pragma once

#include "models/urdf/urdf_faults.h"
#include "models/urdf/urdf_outline.h"

namespace sysid {

// Checks that the joints make a tree on one root and that something moves; sets
// outline->root.
void CheckTree(UrdfOutline* outline, UrdfFaults* faults);

// The joints with parents before children, else in the order of the file.
// `outline` is a tree.
std::vector<int> ParentsFirst(const UrdfOutline& outline);

}  // namespace sysid
