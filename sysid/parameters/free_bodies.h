#pragma once

#include <vector>

#include "models/model.h"
#include "sysid/parameters/free_parameter.h"

namespace sysid {

// Mass, centre of mass and inertia of these links, all free, from the model's
// values: what `--free inertial` frees of them.
std::vector<FreeParameter> FreeBodies(const Model& model,
                                      const std::vector<int>& links);

}  // namespace sysid
