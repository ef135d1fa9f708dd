#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "models/effects/hinge_friction.h"

namespace sysid {

// Friction that is not the same in both directions, of gears and seals (Swevers
// et al. 1997): with s = sign(qd),
//   tau = -(c + a s) s - (d + b s) qd,
// c and d the means of both directions, a and b how much more is forwards and
// less backwards: linear in all four. Its first term is dry friction of the
// level c beside the constant force -a, which is so at rest, too: the joint
// holds from -(c - a) to c + a. Smoothed, s is qd / sqrt(qd^2 + v_s^2)
// (coulomb_friction.h). It takes the place of Coulomb friction and viscous
// damping.
class AsymmetricFriction : public HingeFriction<AsymmetricFriction> {
 public:
  static constexpr char kName[] = "asymmetric_friction";
  static constexpr char kLaw[] = "-(c + a s) s - (d + b s) qd, s = sign(qd)";
  static constexpr char kShowsIn[] =
      "both directions of the joint, slow and fast";
  // To a check of the data it is Coulomb friction, damping and an effort's
  // bias, which may be there one by one.
  static constexpr bool kOnlyNamed = true;

  AsymmetricFriction(const Mechanism& mechanism, const std::string& joint)
      : HingeFriction(kName, kBesideDryHook, mechanism, joint) {
    AddParameter(joint + ".friction", "{effort}", 0.01, 0.0);
    AddParameter(joint + ".damping", "{effort} s/{position}", 0.01, 0.0);
    AddParameter(joint + ".friction_asymmetry", "{effort}", 0.01);
    AddParameter(joint + ".damping_asymmetry", "{effort} s/{position}", 0.01);
  }

  template <typename T>
  T DryFriction(const JointState<T>&, const T* p, const T& /*speed*/) const {
    return p[0];
  }

  template <typename T>
  void AddBesideDry(const JointState<T>& joint, const T* p, T* tau) const {
    const T& qd = joint.qd[0];
    const T speed = ValueOf(qd) < 0.0 ? T(-qd) : qd;
    tau[0] -= p[2] + p[1] * qd + p[3] * speed;
  }

  // More than a direction's whole friction would drive the joint that way,
  // slow (a) or fast (b); a little more may be an estimate of zero.
  std::string Implausible(const std::vector<double>& values) const override {
    constexpr double kClearly = 2.0;
    return std::abs(values[3]) > kClearly * values[1] ||
                   std::abs(values[2]) > kClearly * values[0]
               ? "it drives the joint in one direction"
               : "";
  }
};

}  // namespace sysid
