#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "models/effects/effect.h"
#include "models/effects/joint_elasticity.h"

namespace sysid {

// A drive behind a gap of 2 b: joint elasticity (joint_elasticity.h) whose
// spring and damper bend where the teeth touch alone (Nordin and Gutman 2002).
// With the bend x = theta - q the force is k g(x) + d g'(x) x',
//   g(x) = x + (r(x - b) - r(x + b)) / 2,   r(y) = sqrt(y^2 + s^2),
// which is x - b beyond the gap, x + b before it, 0 within; s, a tenth of b,
// rounds its corners.
class Backlash : public EffectOf<Backlash> {
 public:
  static constexpr char kName[] = "backlash";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] =
      "joint elasticity whose spring and damper have a gap between them and "
      "the joint";
  static constexpr char kShowsIn[] =
      "reversals of the effort, where the drive crosses the gap";
  static constexpr bool kOnlyNamed = true;

  Backlash(const Mechanism& mechanism, const std::string& joint)
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
    AddParameter(joint + ".backlash", "{position}", 0.01, 0.0, 10.0);
    SetStart(3, IsPrismatic() ? 0.001 : 0.01);
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
    const double effort = ValueOf(joint.effort[0]);
    if (effort != 0.0) z[0] += std::copysign(0.5, effort) * p[3];
  }

  std::vector<ProbeSet> ProbeSets() const override {
    std::vector<ProbeSet> sets;
    for (const double gap : {0.003, 0.03}) {
      for (ProbeSet& set : ElasticDrive::ProbeSets({0.0, 0.0, 0.0, gap})) {
        sets.push_back(std::move(set));
      }
    }
    return sets;
  }
  std::vector<double> FromProbes(
      const ProbeSet& probes,
      const std::vector<double>& weights) const override {
    return ElasticDrive::FromProbes(probes, weights);
  }

 private:
  template <typename T>
  static T Force(const JointState<T>& joint, const T* p) {
    using std::sqrt;
    constexpr double kLeast = 1e-6;  // of s: the slope by b at b = 0
    const T b = 0.5 * p[3];
    const T s2 = 0.01 * b * b + T(kLeast * kLeast);
    const T before = joint.z[0] - b, beyond = joint.z[0] + b;
    const T r_before = sqrt(before * before + s2);
    const T r_beyond = sqrt(beyond * beyond + s2);
    const T spring = joint.z[0] + 0.5 * (r_before - r_beyond);
    const T slope = T(1.0) + 0.5 * (before / r_before - beyond / r_beyond);
    return ElasticDrive::Force<T>(joint, p, spring, slope);
  }
};

}  // namespace sysid
