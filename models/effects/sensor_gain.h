#pragma once

#include <string>

#include "models/effects/effect.h"

namespace sysid {

// measured = (1 + g) true on a joint of one degree of freedom: a wrong number
// of lines of an encoder, a potentiometer's scale.
class SensorGain : public EffectOf<SensorGain> {
 public:
  static constexpr char kName[] = "sensor_gain";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr bool kOnMotorToo = true;
  static constexpr char kLaw[] = "measured = (1 + g) true";
  static constexpr char kShowsIn[] = "large beside small motion of the joint";

  // A diagnosis asks that of the data (docs/checks.md).
  static constexpr bool kOnlyNamed = true;

  SensorGain(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kMeasurementHook, mechanism, joint) {
    AddParameter(joint + ".sensor_gain", "-", 0.01, -0.9, 10.0);
  }

  static bool Applies(JointType type) { return type != JointType::kSpherical; }

  template <typename T>
  void ModifyMeasurement(const JointRates<T>&, const T* p, T* q) const {
    q[0] += p[0] * q[0];
  }
};

}  // namespace sysid
