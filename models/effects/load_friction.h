#pragma once

#include <cmath>
#include <string>

#include "models/effects/hinge_friction.h"

namespace sysid {

// Dry friction of a gear that grows with what the drive gives: of the level
//   mu |u|,
// u the drive's effort at the joint (Duclusaud et al., "Extended Friction
// Models for the Physics Simulation of Servo Actuators", 2024: M2). Smoothed as
// in coulomb_friction.h.
class LoadFriction : public HingeFriction<LoadFriction> {
 public:
  static constexpr char kName[] = "load_friction";
  static constexpr char kLaw[] = "-mu |u| sign(qd), u the drive's effort";
  static constexpr char kShowsIn[] =
      "motion under light and heavy loads: it and other friction differ only "
      "where the load changes";

  LoadFriction(const Mechanism& mechanism, const std::string& joint)
      : HingeFriction(kName, kReadsEffort, mechanism, joint) {
    AddParameter(joint + ".load_friction", "-", 0.1, 0.0, 1.0);
  }

  template <typename T>
  T DryFriction(const JointState<T>& joint, const T* p,
                const T& /*speed*/) const {
    const T& u = joint.effort[0];
    return p[0] * (ValueOf(u) < 0.0 ? T(-u) : u);
  }
};

// The same with another level near rest (M5 there): of the level
//   (mu (1 - e) + mu_s e) |u|,  e = exp(-qd^2 / v^2).
class LoadStribeckFriction : public HingeFriction<LoadStribeckFriction> {
 public:
  static constexpr char kName[] = "load_stribeck_friction";
  static constexpr char kLaw[] =
      "-mu |u| sign(qd), more of it at rest, u the drive's effort";
  static constexpr char kShowsIn[] =
      "very slow beside fast motion, under light and heavy loads";
  // Beside load_friction and stribeck_friction few recordings tell it.
  static constexpr bool kOnlyNamed = true;

  LoadStribeckFriction(const Mechanism& mechanism, const std::string& joint)
      : HingeFriction(kName, kReadsEffort, mechanism, joint) {
    const double unit = IsPrismatic() ? 0.1 : 1.0;
    AddParameter(joint + ".load_friction", "-", 0.1, 0.0, 1.0);
    AddParameter(joint + ".static_load_friction", "-", 0.2, 0.0, 1.0);
    AddSearchedParameter(joint + ".load_stribeck_velocity", "{position}/s",
                         0.1 * unit,
                         {0.03 * unit, 0.1 * unit, 0.3 * unit, 1.0 * unit},
                         0.02 * unit, 1e3 * unit);
  }

  void Subsume(std::vector<double>* values) const override {
    (*values)[1] = (*values)[0];
  }

  template <typename T>
  T DryFriction(const JointState<T>& joint, const T* p, const T& speed) const {
    using std::exp;
    const T& u = joint.effort[0];
    const T e = exp(-speed * speed / (p[2] * p[2]));
    return (p[0] + (p[1] - p[0]) * e) * (ValueOf(u) < 0.0 ? T(-u) : u);
  }
};

// A gear that loses another part of the drive's effort u when it drives
// (u qd > 0) than when it is driven (strain-wave and cycloidal gears; M6
// there): dry friction of the level (a + b) |u| / 2 beside the force
// -(a - b) u / 2, a and b the parts lost.
class GearEfficiency : public HingeFriction<GearEfficiency> {
 public:
  static constexpr char kName[] = "gear_efficiency";
  static constexpr char kLaw[] =
      "-a |u| sign(qd) where the drive drives, -b |u| sign(qd) where it is "
      "driven";
  static constexpr char kShowsIn[] =
      "lifting beside lowering of a load, at the same speeds";
  // To first order it is load_friction and an effort_gain.
  static constexpr bool kOnlyNamed = true;

  GearEfficiency(const Mechanism& mechanism, const std::string& joint)
      : HingeFriction(kName, kBesideDryHook | kReadsEffort, mechanism, joint) {
    AddParameter(joint + ".loss_driving", "-", 0.1, 0.0, 1.0);
    AddParameter(joint + ".loss_driven", "-", 0.1, 0.0, 1.0);
  }

  template <typename T>
  T DryFriction(const JointState<T>& joint, const T* p,
                const T& /*speed*/) const {
    const T& u = joint.effort[0];
    return 0.5 * (p[0] + p[1]) * (ValueOf(u) < 0.0 ? T(-u) : u);
  }

  template <typename T>
  void AddBesideDry(const JointState<T>& joint, const T* p, T* tau) const {
    tau[0] -= 0.5 * (p[0] - p[1]) * joint.effort[0];
  }
};

}  // namespace sysid
