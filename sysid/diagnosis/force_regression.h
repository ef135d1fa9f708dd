#pragma once

#include <vector>

#include "sysid/diagnosis/force_knots.h"
#include "sysid/diagnosis/forced_motion.h"
#include "sysid/diagnosis/smooth_force.h"
#include "sysid/diagnosis/unexplained_force.h"

namespace sysid {

// What the force of a body's joint follows along the motions of the segments:
// each regressor alone, (7.10), best first.
std::vector<ForceRegression> RegressForce(
    const LinearizedFit& fit, const std::vector<ForceKnots>& knots,
    const SmoothForce& force, const std::vector<ForcedMotion>& motions,
    const Body& body);

}  // namespace sysid
