#pragma once

#include <string>

#include "models/effects/effect.h"

namespace sysid {

// The base or pivot is accelerated by a (base.ax, base.ay, base.az, world axes;
// of base.px..pz their second derivative): in its axes all that moves feels
// gravity less g a. g is 1 where the accelerometer is right; 0 is a base at
// rest.
class BaseMotion : public EffectOf<BaseMotion> {
 public:
  static constexpr char kName[] = "base_motion";
  static constexpr TargetKind kTarget = TargetKind::kBase;
  static constexpr char kLaw[] = "gravity less g a, a the base's acceleration";
  static constexpr char kShowsIn[] = "motion of the base";

  BaseMotion(const Mechanism& mechanism, const std::string& base)
      : EffectOf(kName, kGravityHook, mechanism, base) {
    AddParameter("base_motion_gain", "-", 1.0, -10.0, 10.0);
    for (const char* axis : {"base.ax", "base.ay", "base.az"}) {
      ReadsInput(axis, "m/s^2");
    }
  }

  template <typename T>
  void ModifyGravity(const T* inputs, const T* p, Vector3<T>* gravity) const {
    for (int k = 0; k < 3; ++k) (*gravity)[k] -= p[0] * inputs[k];
  }
};

}  // namespace sysid
