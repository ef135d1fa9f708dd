#pragma once

#include <string>

#include "models/effects/effect.h"

namespace sysid {

// The position sensor of a joint is late by d, s: measured(t) = true(t - d),
//   q - d qd + d^2 qdd / 2,
// right to d^3 / 6 of the jerk: at 10 ms and motions of 2 Hz 3e-4 of their
// size, below what a sensor so late resolves.
class SensorDelay : public EffectOf<SensorDelay> {
 public:
  static constexpr char kName[] = "sensor_delay";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr bool kOnMotorToo = true;
  static constexpr char kLaw[] = "measured(t) = true(t - d)";
  static constexpr char kShowsIn[] =
      "quick motion of the joint beside sensors or efforts that are not late";

  // A diagnosis asks that of the data (docs/checks.md).
  static constexpr bool kOnlyNamed = true;

  SensorDelay(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kMeasurementHook | kRatesHook, mechanism, joint) {
    AddParameter(joint + ".sensor_delay", "s", 0.01, 0.0, 0.2);
  }

  static bool Applies(JointType type) { return type != JointType::kSpherical; }

  template <typename T>
  void ModifyMeasurement(const JointRates<T>& rates, const T* p, T* q) const {
    q[0] -= p[0] * (rates.qd[0] - 0.5 * p[0] * rates.qdd[0]);
  }
};

}  // namespace sysid
