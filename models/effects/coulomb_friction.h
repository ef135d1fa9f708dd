#pragma once

#include <cmath>
#include <string>

#include "models/effects/effect.h"

namespace sysid {

// v_s of a joint where its dry friction is smoothed: 5 mrad/s, or 1 mm/s of a
// slide. A tenth of it would need steps a tenth as long.
inline double FrictionSmoothingSpeed(bool prismatic) {
  return prismatic ? 1e-3 : 5e-3;
}

// sign(qd) of a hinge or slide where its dry friction is smoothed.
template <typename T>
T SmoothSign(const T& qd, double v_s) {
  using std::sqrt;
  return qd / sqrt(qd * qd + T(v_s * v_s));
}

// Dry friction of one level c: -c sign(qd) where the joint slips, and whatever
// holds it, up to c, where it rests (docs/dry_friction.md). Smoothed:
//   tau = -c qd / sqrt(|qd|^2 + v_s^2),
// for a spherical joint along the direction of the relative angular velocity;
// at ten times v_s this is within 0.5 % of c.
class CoulombFriction : public EffectOf<CoulombFriction> {
 public:
  static constexpr char kName[] = "coulomb_friction";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] =
      "-c sign(qd); at rest it holds whatever is less than c";
  static constexpr char kShowsIn[] =
      "both slow and fast motion of the joint, with reversals";

  CoulombFriction(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kEffortHook | kDryFrictionHook, mechanism, joint),
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

  template <typename T>
  T DryFriction(const JointState<T>&, const T* p, const T& /*speed*/) const {
    return p[0];
  }

 private:
  double smoothing_speed_;
};

}  // namespace sysid
