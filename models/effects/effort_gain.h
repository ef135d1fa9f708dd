#pragma once

#include <string>

#include "models/effects/effect.h"

namespace sysid {

// true effort = (1 + g) measured effort: a motor constant, a gear ratio, a
// sensor's scale; g = -2 is a wrong sign.
class EffortGain : public EffectOf<EffortGain> {
 public:
  static constexpr char kName[] = "effort_gain";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] = "true effort = (1 + g) measured effort";
  static constexpr char kShowsIn[] =
      "motion with the drive beside motion without it";

  EffortGain(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kInputHook, mechanism, joint),
        nv_(VelocitySize(mechanism.joints[this->joint()].type)) {
    // Wide: efforts may be recorded in volts, amperes or per mille.
    AddParameter(joint + ".effort_gain", "-", 0.1, -1e3, 1e3);
  }

  template <typename T>
  void ModifyInput(const T* p, T* tau) const {
    for (int i = 0; i < nv_; ++i) tau[i] += p[0] * tau[i];
  }

 private:
  int nv_;
};

}  // namespace sysid
