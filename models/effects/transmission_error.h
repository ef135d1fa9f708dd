#pragma once

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "models/effects/effect.h"

namespace sysid {

// measured = q + a sin(n q) + b cos(n q), rad: what a gear's teeth or an
// eccentric ring add to what the sensor behind them says (Tuttle and Seering
// 1996); n, how often in a turn, is searched.
class TransmissionError : public EffectOf<TransmissionError> {
 public:
  static constexpr char kName[] = "transmission_error";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] = "measured = q + a sin(n q) + b cos(n q)";
  static constexpr char kShowsIn[] = "slow motion through whole turns";
  static constexpr bool kNeedsDrive = true;
  // Two dozen orders for each joint, and cogging beside it.
  static constexpr bool kOnlyNamed = true;

  TransmissionError(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kMeasurementHook, mechanism, joint) {
    AddParameter(joint + ".transmission_sin", "rad", 0.001);
    AddParameter(joint + ".transmission_cos", "rad", 0.001);
    constexpr int kMost = 24;
    std::vector<double> orders(kMost);
    std::iota(orders.begin(), orders.end(), 1.0);
    AddSearchedParameter(joint + ".transmission_order", "-", 1.0, orders, 1.0,
                         1000.0, true);
  }

  static bool Applies(JointType type) { return IsRotation1(type); }

  template <typename T>
  void ModifyMeasurement(const JointRates<T>&, const T* p, T* q) const {
    using std::cos;
    using std::sin;
    const T angle = p[2] * q[0];
    q[0] += p[0] * sin(angle) + p[1] * cos(angle);
  }
};

}  // namespace sysid
