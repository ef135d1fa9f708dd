#pragma once

#include <string>

#include "models/effects/effect.h"

namespace sysid {

// tau = -d qd; spherical: -d w, w the relative angular velocity.
// d in N m s/rad or N s/m.
class ViscousDamping : public EffectOf<ViscousDamping> {
 public:
  static constexpr char kName[] = "viscous_damping";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] = "-d qd";
  static constexpr char kShowsIn[] = "both slow and fast motion of the joint";

  ViscousDamping(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kEffortHook, mechanism, joint) {
    AddParameter(joint + ".damping", "{effort} s/{position}", 0.01, 0.0);
  }

  template <typename T>
  void AddEffort(const JointState<T>& joint, const T* p, T* tau) const {
    for (int i = 0; i < joint.nv; ++i) tau[i] -= p[0] * joint.qd[i];
  }
};

}  // namespace sysid
