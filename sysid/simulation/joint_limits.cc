#include "sysid/simulation/joint_limits.h"

#include <algorithm>

namespace sysid {

Joint LimitedJoint(const Model& model, const Body& mover) {
  const std::vector<Joint>& joints = model.mechanism().joints;
  Joint limited = joints[mover.joint];
  for (const Body& body : model.followers()) {
    if (model.bodies()[body.leader].joint != mover.joint) continue;
    const Joint& follower = joints[body.joint];
    if (!follower.has_limits || body.multiplier == 0.0) continue;
    if (!limited.has_limits) {
      limited.has_limits = true;
      limited.lower = -HUGE_VAL;
      limited.upper = HUGE_VAL;
    }
    const double factor = body.multiplier;
    limited.velocity_limit = std::min(
        VelocityLimit(limited), VelocityLimit(follower) / std::abs(factor));
    if (!HasPositionLimits(follower)) continue;
    double lower = (follower.lower - body.offset) / factor;
    double upper = (follower.upper - body.offset) / factor;
    if (lower > upper) std::swap(lower, upper);
    lower = std::max(lower, limited.lower);
    upper = std::min(upper, limited.upper);
    if (!(lower < upper)) continue;
    limited.lower = lower;
    limited.upper = upper;
  }
  return limited;
}

}  // namespace sysid
