#pragma once

#include <string>
#include <vector>

#include "models/effects/coulomb_friction.h"
#include "models/effects/effect.h"

namespace sysid {

// A motor of a wrist that turns with two joints: its rotor and its friction act
// on z = q_1 + s q_2, s = 1 or -1 (Gautier et al. 2013, of Staubli arms):
//   -(I zdd + d zd + c sign(zd))   on joint 1, s times that on joint 2.
// sign() is smoothed as in coulomb_friction.h: the joints may rest while it
// slips, so that it has no modes of its own.
class GearCoupling : public EffectOf<GearCoupling> {
 public:
  static constexpr char kName[] = "gear_coupling";
  static constexpr TargetKind kTarget = TargetKind::kJointPair;
  static constexpr char kLaw[] =
      "-(I zdd + d zd + c sign(zd)), z = q_1 + s q_2, on both joints";
  static constexpr char kShowsIn[] =
      "motion of either joint while the other rests";
  static constexpr bool kNeedsDrive = true;

  GearCoupling(const Mechanism& mechanism, const std::string& joints)
      : EffectOf(kName, kPairHook, mechanism, joints),
        smoothing_speed_(FrictionSmoothingSpeed(IsPrismatic())) {
    // Of the second: the first may be in several pairs.
    const std::string name = mechanism.joints[second_joint()].name;
    AddParameter(name + ".coupling_armature", IsPrismatic() ? "kg" : "kg m^2",
                 0.01, 0.0);
    AddParameter(name + ".coupling_damping", "{effort} s/{position}", 0.01,
                 0.0);
    AddParameter(name + ".coupling_friction", "{effort}", 0.01, 0.0);
    AddSearchedParameter(name + ".coupling_sign", "-", 1.0, {1.0, -1.0}, -1.0,
                         1.0, true);
  }

  static bool Applies(JointType type) { return type != JointType::kSpherical; }

  template <typename T>
  T Ratio(const T* p) const {
    return p[3];
  }
  template <typename T>
  T PairInertia(const T* p) const {
    return p[0];
  }
  template <typename T>
  T PairEffort(const T& rate, const T* p) const {
    return -p[1] * rate - p[2] * SmoothSign(rate, smoothing_speed_);
  }

 private:
  double smoothing_speed_;
};

}  // namespace sysid
