#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "models/effects/effect.h"

namespace sysid {

// A drive that is not rigidly on its joint (Spong 1987). With the motor's angle
// theta on the joint's side of the gear, z = (theta - q, theta') and the
// drive's effort u,
//   I theta'' = u - f,   f = k g(z_1) + d g'(z_1) (theta' - qd),
// and the joint feels f instead of u. q is what the joint's own sensor
// measures, behind the spring, theta what one at the motor does. Rigid at k =
// kRigid, and I then no part of the joint. A law has g:
//   template <typename T>
//   void Spring(const JointState<T>&, const T* p, T* g, T* slope) const;
// and the bend at which its spring begins to hold an effort,
//   template <typename T>
//   T Slack(const T* p) const;
// with parameters of its own from place kOwn.
template <class Derived>
class ElasticDrive : public EffectOf<Derived> {
 public:
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  // Too many stiffnesses for each joint to be tried without a hint.
  static constexpr bool kOnlyNamed = true;

  // The null of the stiffness, and below it where a drive is still rigid: with
  // a motor of 0.01 kg m^2 the drive swings at 22,000 rad/s there, and a step
  // of Runge and Kutta's method that is stable (2.8 of its radians) takes 0.1
  // ms.
  static constexpr double kRigid = 1e7;
  static constexpr double kStiffest = 5e6;

  static bool Applies(JointType type) { return type != JointType::kSpherical; }

  template <typename T>
  void AddEffort(const JointState<T>& joint, const T* p, T* tau) const {
    if (IsRigid(p)) return;
    tau[0] += Force(joint, p) - joint.effort[0];
  }
  template <typename T>
  void StateRate(const JointState<T>& joint, const T* p, T* rate) const {
    if (IsRigid(p)) return;
    rate[0] = joint.z[1] - joint.qd[0];
    rate[1] = (joint.effort[0] - Force(joint, p)) / p[2];
  }
  // Bent as the effort holds it, and moving with the joint.
  template <typename T>
  void StartState(const JointState<T>& joint, const T* p, T* z) const {
    z[0] = joint.effort[0] / p[0];
    z[1] = joint.qd[0];
    const double effort = ValueOf(joint.effort[0]);
    if (effort == 0.0) return;
    z[0] += std::copysign(1.0, effort) * law().template Slack<T>(p);
  }

  // theta = q + z_1, theta' = z_2.
  template <typename T>
  void ToMotor(const T* z, const T* z_rate, const T* p, T* q, T* qd,
               T* qdd) const {
    if (IsRigid(p)) return;
    *q += z[0];
    *qd = z[1];
    *qdd = z_rate[1];
  }

  std::vector<ProbeSet> ProbeSets() const override {
    return ProbesFor({0.0, 0.0, 0.0});
  }
  // The stiffness of the probe, whatever its weight, but for none: between it
  // and a rigid drive the law is no sum of both.
  std::vector<double> FromProbes(
      const ProbeSet& probes,
      const std::vector<double>& weights) const override {
    std::vector<double> values = probes[0].at;
    if (weights[0] != 0.0) values[0] += probes[0].secant;
    return values;
  }

 protected:
  static constexpr int kOwn = 3;

  ElasticDrive(const char* kind, const Mechanism& mechanism,
               const std::string& joint)
      : EffectOf<Derived>(
            kind, kEffortHook | kReadsEffort | kStateRateHook | kMotorHook,
            mechanism, joint) {
    this->AddParameter(joint + ".drive_stiffness", "{effort}/{position}",
                       1000.0, 1e-3, kRigid);
    this->SetNull(0, kRigid);
    this->SetStart(0, 1000.0);
    this->AddParameter(joint + ".drive_damping", "{effort} s/{position}", 1.0,
                       0.0);
    this->AddParameter(joint + ".motor_inertia",
                       this->IsPrismatic() ? "kg" : "kg m^2", 0.01, 1e-9);
    this->SetNull(2, 0.01);
    this->AddState(joint + ".deflection", "{position}", 0.01);
    this->AddState(joint + ".motor_speed", "{position}/s", 1.0);
  }

  // By secants, for each order of size of the stiffness and the inertia, with a
  // damping of 5 % of the critical one; the law bends between them. `at` has
  // the parameters' places, and the values of the law's own.
  static std::vector<ProbeSet> ProbesFor(std::vector<double> at) {
    std::vector<ProbeSet> sets;
    for (const double inertia : {0.003, 0.03, 0.3}) {
      for (const double stiffness : {30.0, 100.0, 300.0, 1e3, 3e3, 1e4, 3e4}) {
        at[0] = kRigid;
        at[1] = 0.1 * std::sqrt(stiffness * inertia);
        at[2] = inertia;
        sets.push_back({{at, 0, stiffness - kRigid}});
      }
    }
    return sets;
  }

 private:
  const Derived& law() const { return static_cast<const Derived&>(*this); }

  template <typename T>
  static bool IsRigid(const T* p) {
    return ValueOf(p[0]) > kStiffest;
  }
  template <typename T>
  T Force(const JointState<T>& joint, const T* p) const {
    T g, slope;
    law().template Spring<T>(joint, p, &g, &slope);
    return p[0] * g + p[1] * slope * (joint.z[1] - joint.qd[0]);
  }
};

}  // namespace sysid
