#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "models/effects/coulomb_friction.h"
#include "models/effects/effect.h"

namespace sysid {

// Coulomb friction with another level near rest (Stribeck 1902; Armstrong-
// Helouvry et al. 1994): dry friction of the level
//   c (1 - e) + s e,  e = exp(-|qd|^2 / v^2),
// c the friction of fast motion, s the static friction, v the Stribeck
// velocity. Smoothed as in coulomb_friction.h, it is that times
// -qd / sqrt(|qd|^2 + v_s^2). Linear in c and s; v is searched.
class StribeckFriction : public EffectOf<StribeckFriction> {
 public:
  static constexpr char kName[] = "stribeck_friction";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] =
      "-c sign(qd), more of it at rest, which holds and decays with speed";
  static constexpr char kShowsIn[] =
      "very slow beside fast motion of the joint";

  StribeckFriction(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kEffortHook | kDryFrictionHook, mechanism, joint),
        smoothing_speed_(FrictionSmoothingSpeed(IsPrismatic())) {
    // A slide's speeds: a tenth of the angular ones, in m/s. The least is some
    // times the smoothing speed: below, where the law is smoothed, the peak
    // would be within the smoothing.
    const double unit = IsPrismatic() ? 0.1 : 1.0;
    AddParameter(joint + ".friction", "{effort}", 0.01, 0.0);
    // Higher, as it is in practice: with both the same the velocity has no
    // influence.
    AddParameter(joint + ".static_friction", "{effort}", 0.02, 0.0);
    AddSearchedParameter(joint + ".stribeck_velocity", "{position}/s",
                         0.1 * unit,
                         {0.03 * unit, 0.1 * unit, 0.3 * unit, 1.0 * unit},
                         0.02 * unit, 1e3 * unit);
  }

  // Coulomb friction is the same at every speed.
  void Subsume(std::vector<double>* values) const override {
    (*values)[1] = (*values)[0];
  }

  template <typename T>
  void AddEffort(const JointState<T>& joint, const T* p, T* tau) const {
    using std::sqrt;
    T speed2 = T(0.0);
    for (int i = 0; i < joint.nv; ++i) speed2 += joint.qd[i] * joint.qd[i];
    const T scale =
        Level(p, speed2) / sqrt(speed2 + smoothing_speed_ * smoothing_speed_);
    for (int i = 0; i < joint.nv; ++i) tau[i] -= scale * joint.qd[i];
  }

  template <typename T>
  T DryFriction(const JointState<T>&, const T* p, const T& speed) const {
    return Level<T>(p, speed * speed);
  }

  std::string Implausible(const std::vector<double>& values) const override {
    if (values[1] < values[0]) {
      return "its static friction is below its friction";
    }
    // The bound of the velocity: no slow motion is slow enough for it.
    return values[2] <= 1.01 * parameters()[2].lower
               ? "its peak is too narrow to be told from Coulomb friction"
               : "";
  }

 private:
  template <typename T>
  static T Level(const T* p, const T& speed2) {
    using std::exp;
    const T e = exp(-speed2 / (p[2] * p[2]));
    return p[0] + (p[1] - p[0]) * e;
  }

  double smoothing_speed_;
};

}  // namespace sysid
