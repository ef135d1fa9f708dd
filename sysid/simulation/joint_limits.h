#pragma once

#include <cmath>

#include "models/model.h"

namespace sysid {

// What a URDF's <limit> says of a joint that is taken to mean something.

// A continuous joint's mean nothing, nor do reversed, empty or infinite ones.
inline bool HasPositionLimits(const Joint& joint) {
  return joint.has_limits && joint.lower < joint.upper &&
         std::isfinite(joint.upper - joint.lower) &&
         (joint.type == JointType::kRevolute ||
          joint.type == JointType::kPrismatic);
}

// N m or N, rad/s or m/s; infinite where the file says none, or zero, which
// stands in many files for what nobody knew.
inline double EffortLimit(const Joint& joint) {
  return joint.has_limits && joint.effort_limit > 0 ? joint.effort_limit
                                                    : HUGE_VAL;
}
inline double VelocityLimit(const Joint& joint) {
  return joint.has_limits && joint.velocity_limit > 0 ? joint.velocity_limit
                                                      : HUGE_VAL;
}

// A mover's joint with its limits of position and velocity narrowed to those
// that its followers keep with theirs. Where no position is in all of them, the
// joint's own stay.
Joint LimitedJoint(const Model& model, const Body& mover);

}  // namespace sysid
