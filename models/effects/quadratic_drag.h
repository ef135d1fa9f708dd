#pragma once

#include <cmath>
#include <string>

#include "models/effects/effect.h"

namespace sysid {

// tau = -b |qd| qd; spherical: along the relative angular velocity.
// b in N m s^2/rad^2 or N s^2/m^2.
class QuadraticDrag : public EffectOf<QuadraticDrag> {
 public:
  static constexpr char kName[] = "quadratic_drag";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] = "-b |qd| qd";
  static constexpr char kShowsIn[] = "both slow and fast motion of the joint";

  QuadraticDrag(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kEffortHook, mechanism, joint) {
    AddParameter(joint + ".quadratic_drag", "{effort} s^2/{position}^2", 0.01,
                 0.0);
  }

  template <typename T>
  void AddEffort(const JointState<T>& joint, const T* p, T* tau) const {
    using std::sqrt;
    // Smooth about rest, within 0.01 rad/s or m/s, where it brakes nothing.
    T speed2 = T(1e-4);
    for (int i = 0; i < joint.nv; ++i) speed2 += joint.qd[i] * joint.qd[i];
    const T scale = p[0] * sqrt(speed2);
    for (int i = 0; i < joint.nv; ++i) tau[i] -= scale * joint.qd[i];
  }
};

}  // namespace sysid
