#pragma once

#include <string>
#include <vector>

#include "models/effects/effect.h"

// What may be wrong with the measured efforts.

namespace sysid {

// A constant effort on a joint of one degree of freedom, N m or N: a drive's
// offset, a cable's pull.
class EffortBias : public EffectOf<EffortBias> {
 public:
  static constexpr char kName[] = "effort_bias";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] = "constant effort";
  static constexpr char kShowsIn[] =
      "motion about several positions of the joint, both ways";

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
    AddParameter(joint + ".effort_gain", "-", 0.1, -10.0, 10.0);
  }

  template <typename T>
  void ModifyInput(const T* p, T* tau) const {
    for (int i = 0; i < nv_; ++i) tau[i] += p[0] * tau[i];
  }

 private:
  int nv_;
};

// All measured efforts act later, s: a bus, a controller's cycle. The law is
// linear in it only within a sample, so longer ones are searched by secants.
class EffortDelay : public EffectOf<EffortDelay> {
 public:
  static constexpr char kName[] = "effort_delay";
  static constexpr TargetKind kTarget = TargetKind::kBase;
  static constexpr char kLaw[] = "the measured effort acts later";
  static constexpr char kShowsIn[] = "efforts that change quickly";

  EffortDelay(const Mechanism& mechanism, const std::string& base)
      : EffectOf(kName, kInputDelayHook, mechanism, base) {
    AddParameter("effort_delay", "s", 0.01, 0.0, 1.0);
  }

  template <typename T>
  void AddInputDelay(const T* p, T* delay) const {
    *delay += p[0];
  }

  std::vector<ProbeSet> ProbeSets() const override {
    std::vector<ProbeSet> sets;
    for (const double secant : {0.0, 0.005, 0.01, 0.02, 0.05, 0.1}) {
      sets.push_back({{{0.0}, 0, secant}});
    }
    return sets;
  }
};

}  // namespace sysid
