#pragma once

#include <cmath>
#include <string>

#include "models/effects/hinge_friction.h"

namespace sysid {

// Friction that falls with the measured temperature (J.temperature, deg C), as
// a lubricant's viscosity does (Bittencourt et al. 2013):
//   tau = -(c sign(qd) + d qd) exp(-k (temperature - 20)),
// c and d those at 20 deg C. It takes the place of Coulomb friction and viscous
// damping, and is looked for where one of them is in the model.
class ThermalFriction : public HingeFriction<ThermalFriction> {
 public:
  static constexpr char kName[] = "thermal_friction";
  static constexpr char kLaw[] =
      "-(c sign(qd) + d qd) exp(-k (temperature - 20))";
  static constexpr char kShowsIn[] =
      "motion while cold beside motion while warm";
  static constexpr bool kExtends = true;
  static constexpr double kReference = 20.0;  // deg C

  ThermalFriction(const Mechanism& mechanism, const std::string& joint)
      : HingeFriction(kName, kBesideDryHook, mechanism, joint) {
    AddParameter(joint + ".friction", "{effort}", 0.01, 0.0);
    AddParameter(joint + ".damping", "{effort} s/{position}", 0.01, 0.0);
    // A fifth less in ten kelvin.
    AddParameter(joint + ".thermal_rate", "1/K", 0.02, -0.5, 0.5);
    ReadsInput(joint + ".temperature", "deg C");
  }

  template <typename T>
  T DryFriction(const JointState<T>& joint, const T* p,
                const T& /*speed*/) const {
    return p[0] * Fall(joint, p);
  }

  template <typename T>
  void AddBesideDry(const JointState<T>& joint, const T* p, T* tau) const {
    tau[0] -= p[1] * Fall(joint, p) * joint.qd[0];
  }

 private:
  template <typename T>
  static T Fall(const JointState<T>& joint, const T* p) {
    using std::exp;
    return exp(p[2] * (T(kReference) - joint.inputs[0]));
  }
};

}  // namespace sysid
