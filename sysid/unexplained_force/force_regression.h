#pragma once

#include <vector>

#include "sysid/linearization/force_response.h"
#include "sysid/unexplained_force/smooth_force.h"
#include "sysid/unexplained_force/unexplained_force.h"

namespace sysid {

// What the forces of some bodies' joints follow along the motion that they
// lead to: body by body each regressor alone, (7.10), best first.
std::vector<ForceRegression> RegressForces(
    const ForceResponse& response, const SmoothForce& force,
    const std::vector<const Body*>& bodies);

}  // namespace sysid
