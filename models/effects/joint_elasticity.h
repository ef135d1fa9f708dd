#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "models/effects/effect.h"

namespace sysid {

// A drive behind a spring and a damper: a strain-wave gear, a belt, a cable
// (Spong 1987). With the motor's angle theta on the joint's side of the gear,
// z = (theta - q, theta') and the drive's effort u,
//   I theta'' = u - f,   f = k (theta - q) + d (theta' - qd),
// and the joint feels f instead of u. q is what is measured, behind the spring.
// Rigid at k = kRigid, and I then no part of the joint.
//
// (Backlash is the same with a gap; they share what follows.)
class ElasticDrive {
 public:
  static constexpr double kRigid = 1e7;
  // Stiffer ones are rigid: hardly a step could follow.
  static constexpr double kStiffest = 5e6;

  // f, of which `spring` is what bends the spring, and its slope by theta.
  template <typename T>
  static T Force(const JointState<T>& joint, const T* p, const T& spring,
                 const T& slope) {
    return p[0] * spring + p[1] * slope * (joint.z[1] - joint.qd[0]);
  }
  template <typename T>
  static bool IsRigid(const T* p) {
    return ValueOf(p[0]) > kStiffest;
  }
  template <typename T>
  static void Rates(const JointState<T>& joint, const T* p, const T& force,
                    T* rate) {
    rate[0] = joint.z[1] - joint.qd[0];
    rate[1] = (joint.effort[0] - force) / p[2];
  }
  // Bent as the effort holds it, and moving with the joint.
  template <typename T>
  static void Start(const JointState<T>& joint, const T* p, T* z) {
    z[0] = joint.effort[0] / p[0];
    z[1] = joint.qd[0];
  }
  // By secants, for each order of size of the stiffness and the inertia, with a
  // damping of 5 % of the critical one; the law bends between them.
  static std::vector<ProbeSet> ProbeSets(std::vector<double> at) {
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
  // The stiffness of the probe, whatever its weight, but for none: between it
  // and a rigid drive the law is no sum of both.
  static std::vector<double> FromProbes(const ProbeSet& probes,
                                        const std::vector<double>& weights) {
    std::vector<double> values = probes[0].at;
    if (weights[0] != 0.0) values[0] += probes[0].secant;
    return values;
  }
};

class JointElasticity : public EffectOf<JointElasticity> {
 public:
  static constexpr char kName[] = "joint_elasticity";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] =
      "k (theta - q) + d (theta' - qd) in place of the drive's effort u, "
      "I theta'' = u less that";
  static constexpr char kShowsIn[] =
      "efforts near the frequency at which the drive swings against the link";
  static constexpr bool kOnlyNamed = true;

  JointElasticity(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kEffortHook | kReadsEffort | kStateRateHook, mechanism,
                 joint) {
    AddParameter(joint + ".drive_stiffness", "{effort}/{position}", 1000.0,
                 1e-3, ElasticDrive::kRigid);
    SetNull(0, ElasticDrive::kRigid);
    SetStart(0, 1000.0);
    AddParameter(joint + ".drive_damping", "{effort} s/{position}", 1.0, 0.0);
    AddParameter(joint + ".motor_inertia", IsPrismatic() ? "kg" : "kg m^2",
                 0.01, 1e-9);
    SetNull(2, 0.01);
    AddState(joint + ".deflection", "{position}", 0.01);
    AddState(joint + ".motor_speed", "{position}/s", 1.0);
  }

  static bool Applies(JointType type) { return type != JointType::kSpherical; }

  template <typename T>
  void AddEffort(const JointState<T>& joint, const T* p, T* tau) const {
    if (ElasticDrive::IsRigid(p)) return;
    tau[0] += Force(joint, p) - joint.effort[0];
  }
  template <typename T>
  void StateRate(const JointState<T>& joint, const T* p, T* rate) const {
    if (ElasticDrive::IsRigid(p)) return;
    ElasticDrive::Rates<T>(joint, p, Force(joint, p), rate);
  }
  template <typename T>
  void StartState(const JointState<T>& joint, const T* p, T* z) const {
    ElasticDrive::Start(joint, p, z);
  }

  std::vector<ProbeSet> ProbeSets() const override {
    return ElasticDrive::ProbeSets({0.0, 0.0, 0.0});
  }
  std::vector<double> FromProbes(
      const ProbeSet& probes,
      const std::vector<double>& weights) const override {
    return ElasticDrive::FromProbes(probes, weights);
  }

 private:
  template <typename T>
  static T Force(const JointState<T>& joint, const T* p) {
    return ElasticDrive::Force<T>(joint, p, joint.z[0], T(1.0));
  }
};

}  // namespace sysid
