#pragma once

#include <string>

#include "models/effects/effect.h"

namespace sysid {

// A constant effort on a joint of one degree of freedom, N m or N: a drive's
// offset.
class EffortBias : public EffectOf<EffortBias> {
 public:
  static constexpr char kName[] = "effort_bias";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] = "constant effort";
  static constexpr char kShowsIn[] =
      "motion about several positions of the joint, both ways";
  static constexpr bool kNeedsDrive = true;

  EffortBias(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kEffortHook, mechanism, joint) {
    AddParameter(joint + ".effort_bias", "{effort}", 0.01);
  }

  // A scalar bias has no direction in a spherical joint.
  static bool Applies(JointType type) { return type != JointType::kSpherical; }

  template <typename T>
  void AddEffort(const JointState<T>&, const T* p, T* tau) const {
    tau[0] += p[0];
  }
};

}  // namespace sysid
