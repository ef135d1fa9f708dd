#pragma once

#include <string>
#include <vector>

#include "models/effects/effect.h"

namespace sysid {

// The drive follows what it is told as a low-pass of first order: the effort y
// that acts is lag y' = u - y of the measured u (a current loop, a hydraulic
// valve). To first order in the lag it is a delay; longer ones are searched by
// secants.
class ActuatorLag : public EffectOf<ActuatorLag> {
 public:
  static constexpr char kName[] = "actuator_lag";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] =
      "the effort that acts is the measured, low-passed";
  static constexpr char kShowsIn[] = "efforts that change quickly";

  ActuatorLag(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kInputLagHook, mechanism, joint) {
    AddParameter(joint + ".actuator_lag", "s", 0.01, 0.0, 1.0);
  }

  static bool Applies(JointType type) { return type != JointType::kSpherical; }

  template <typename T>
  void AddInputLag(const T* p, T* lag) const {
    *lag += p[0];
  }

  std::vector<ProbeSet> ProbeSets() const override {
    std::vector<ProbeSet> sets;
    for (const double secant : {0.0, 0.01, 0.03, 0.1, 0.3}) {
      sets.push_back({{{0.0}, 0, secant}});
    }
    return sets;
  }
};

}  // namespace sysid
