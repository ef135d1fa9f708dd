#pragma once

#include <cmath>
#include <string>

#include "models/effects/effect.h"

namespace sysid {

// v_s of a joint: 5 mrad/s, or 1 mm/s of a slide. Below it a joint creeps
// instead of sticking, in the time that a swing sticks by less than most
// sensors see; a tenth of it would need steps a tenth as long.
inline double FrictionSmoothingSpeed(bool prismatic) {
  return prismatic ? 1e-3 : 5e-3;
}

// tau = -c qd / sqrt(|qd|^2 + v_s^2): -c sign(qd) away from rest; for a
// spherical joint along the direction of the relative angular velocity. The
// smoothing speed v_s keeps the law differentiable and lets a step integrate
// it; at ten times v_s the law is within 0.5 % of c.
class CoulombFriction : public EffectOf<CoulombFriction> {
 public:
  static constexpr char kName[] = "coulomb_friction";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] = "-c sign(qd), smoothed";
  static constexpr char kShowsIn[] =
      "both slow and fast motion of the joint, with reversals";

  CoulombFriction(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kEffortHook, mechanism, joint),
        smoothing_speed_(FrictionSmoothingSpeed(IsPrismatic())) {
    AddParameter(joint + ".friction", "{effort}", 0.01, 0.0);
  }

  template <typename T>
  void AddEffort(const JointState<T>& joint, const T* p, T* tau) const {
    using std::sqrt;
    T speed2 = T(smoothing_speed_ * smoothing_speed_);
    for (int i = 0; i < joint.nv; ++i) speed2 += joint.qd[i] * joint.qd[i];
    const T scale = p[0] / sqrt(speed2);
    for (int i = 0; i < joint.nv; ++i) tau[i] -= scale * joint.qd[i];
  }

 private:
  double smoothing_speed_;
};

}  // namespace sysid
