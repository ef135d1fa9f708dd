#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "models/effects/effect.h"

namespace sysid {

// A drive gives no more than its motor can: with the torque-speed line of a DC
// motor, of the effort u that is asked
//   min(u, L (1 - r qd)) if u > 0,   max(u, -L (1 + r qd)) if u < 0,
// where neither limit is beyond L nor changes sign. L is the limit at rest, r
// the inverse of the speed without load (0: by effort alone).
class EffortLimit : public EffectOf<EffortLimit> {
 public:
  static constexpr char kName[] = "effort_limit";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] = "the drive's effort within L (1 -+ r qd)";
  static constexpr char kShowsIn[] =
      "efforts that are asked beyond the limit, slow and fast";
  // Thirty-one limits for each joint.
  static constexpr bool kOnlyNamed = true;
  static constexpr double kOff = 1e6;  // a limit that nothing reaches

  EffortLimit(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kLimitHook, mechanism, joint) {
    AddParameter(joint + ".effort_limit", "{effort}", 1.0, 1e-6, kOff);
    SetNull(0, kOff);
    AddParameter(joint + ".inverse_no_load_speed", "s/{position}", 0.1, 0.0,
                 1e3);
  }

  static bool Applies(JointType type) { return type != JointType::kSpherical; }

  template <typename T>
  void LimitDrive(const JointState<T>& joint, const T* p, T* effort) const {
    const bool forward = ValueOf(effort[0]) > 0.0;
    const T towards = forward ? joint.qd[0] : T(-joint.qd[0]);
    T limit = p[0] * (T(1.0) - p[1] * towards);
    if (ValueOf(limit) < 0.0) limit = T(0.0);
    if (ValueOf(limit) > ValueOf(p[0])) limit = p[0];
    const T asked = forward ? effort[0] : T(-effort[0]);
    if (ValueOf(asked) <= ValueOf(limit)) return;
    effort[0] = forward ? limit : T(-limit);
  }

  // By secants, ten for each order of size of the limit: the nearest is within
  // 12 % of any (10^(1/20)), from where a fit moves it by its derivative.
  std::vector<ProbeSet> ProbeSets() const override {
    constexpr int kEach = 10;
    std::vector<ProbeSet> sets;
    for (int i = 0; i <= 3 * kEach; ++i) {
      const double limit = 0.3 * std::pow(10.0, i / double{kEach});
      sets.push_back({{{kOff, 0.0}, 0, limit - kOff}});
    }
    return sets;
  }
  // The limit of the probe, whatever its weight, but for none and for the
  // opposite of a limit, which is beyond the bound.
  std::vector<double> FromProbes(
      const ProbeSet& probes,
      const std::vector<double>& weights) const override {
    const double towards = weights[0] * probes[0].secant;
    const double sign = towards > 0.0 ? 1.0 : towards < 0.0 ? -1.0 : 0.0;
    return {kOff + sign * probes[0].secant, 0.0};
  }
};

}  // namespace sysid
