#pragma once

#include <string>

#include "models/effects/effect.h"

namespace sysid {

// measured = true + offset on a joint of one degree of freedom, rad or m.
class SensorOffset : public EffectOf<SensorOffset> {
 public:
  static constexpr char kName[] = "sensor_offset";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr bool kOnMotorToo = true;
  static constexpr char kLaw[] = "measured = true + offset";
  static constexpr char kShowsIn[] =
      "motion about several positions of the joint";

  SensorOffset(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kMeasurementHook, mechanism, joint) {
    AddParameter(joint + ".sensor_offset", "{position}", 0.01);
  }

  static bool Applies(JointType type) { return type != JointType::kSpherical; }

  template <typename T>
  void ModifyMeasurement(const JointRates<T>&, const T* p, T* q) const {
    q[0] += p[0];
  }
};

}  // namespace sysid
