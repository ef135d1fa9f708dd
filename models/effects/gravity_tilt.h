#pragma once

#include <string>

#include "models/effects/effect.h"
#include "models/math/rotation.h"

namespace sysid {

// The world's vertical leans: gravity is turned by the rotation vector (x, y,
// 0), rad, in world axes. (x alone tips it towards +y, y alone towards -x.)
class GravityTilt : public EffectOf<GravityTilt> {
 public:
  static constexpr char kName[] = "gravity_tilt";
  static constexpr TargetKind kTarget = TargetKind::kBase;
  static constexpr char kLaw[] = "the world's vertical leans";
  static constexpr char kShowsIn[] =
      "motion whose direction towards the vertical changes (another mounting "
      "of the base)";

  GravityTilt(const Mechanism& mechanism, const std::string& base)
      : EffectOf(kName, kGravityHook, mechanism, base) {
    AddParameter("gravity_tilt_x", "rad", 0.01, -1.5, 1.5);
    AddParameter("gravity_tilt_y", "rad", 0.01, -1.5, 1.5);
  }

  template <typename T>
  void ModifyGravity(const T* /*inputs*/, const T* p,
                     Vector3<T>* gravity) const {
    const Quaternion<T> turn = Exp<T>(Vector3<T>(p[0], p[1], T(0.0)));
    *gravity = ToMatrix(turn) * Vector3<T>(*gravity);
  }
};

}  // namespace sysid
