#pragma once

#include <string>

#include "models/effects/effect.h"

namespace sysid {

// tau = -k |qd|^2 qd: damping that grows with speed as that of a lubricant
// whose film breaks down, the odd term after the linear one. In N m s^3/rad^3
// or N s^3/m^3; spherical: of the relative angular velocity.
class CubicDamping : public EffectOf<CubicDamping> {
 public:
  static constexpr char kName[] = "cubic_damping";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] = "-k |qd|^2 qd";
  static constexpr char kShowsIn[] = "very fast beside slow motion";

  // Beside viscous damping and quadratic drag it stands in for either.
  static constexpr bool kOnlyNamed = true;

  CubicDamping(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kEffortHook, mechanism, joint) {
    AddParameter(joint + ".cubic_damping", "{effort} s^3/{position}^3", 0.001,
                 0.0);
  }

  template <typename T>
  void AddEffort(const JointState<T>& joint, const T* p, T* tau) const {
    T speed2 = T(0.0);
    for (int i = 0; i < joint.nv; ++i) speed2 += joint.qd[i] * joint.qd[i];
    const T scale = p[0] * speed2;
    for (int i = 0; i < joint.nv; ++i) tau[i] -= scale * joint.qd[i];
  }
};

}  // namespace sysid
