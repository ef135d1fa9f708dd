#pragma once

#include <string>
#include <vector>

#include "models/effects/effect.h"

namespace sysid {

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
