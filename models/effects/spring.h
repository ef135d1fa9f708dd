#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "models/effects/effect.h"
#include "models/math/rotation.h"

namespace sysid {

// tau = -k (q - q0), k in N m/rad or N/m. On a spherical joint tau = -k phi,
// phi the rotation vector from neutral (the gradient of k |phi|^2 / 2, in the
// child's axes); it has no reference.
class Spring : public EffectOf<Spring> {
 public:
  static constexpr char kName[] = "spring";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] = "-k (q - q0)";
  static constexpr char kShowsIn[] =
      "wide motion of the joint about several positions";

  Spring(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kEffortHook, mechanism, joint) {
    AddParameter(joint + ".stiffness", "{effort}/{position}", 0.1, 0.0);
    if (mechanism.joints[this->joint()].type == JointType::kSpherical) return;
    AddParameter(joint + ".spring_reference", "{position}", 0.1);
  }

  template <typename T>
  void AddEffort(const JointState<T>& joint, const T* p, T* tau) const {
    if (joint.type == JointType::kSpherical) {
      const Vector3<T> phi =
          Log(Quaternion<T>(joint.q[3], joint.q[0], joint.q[1], joint.q[2]));
      for (int i = 0; i < 3; ++i) tau[i] -= p[0] * phi[i];
    } else {
      tau[0] -= p[0] * (joint.q[0] - p[1]);
    }
  }

  // A weak spring from far away is a constant effort in disguise.
  std::string Implausible(const std::vector<double>& values) const override {
    constexpr double kTurn = 6.2831853071795865;
    return values.size() > 1 && !IsPrismatic() && std::abs(values[1]) > kTurn
               ? "its reference is more than a turn away"
               : "";
  }

  // By k at two references, which span every spring:
  //   -a q - b (q - 1) = -(a + b) (q - b / (a + b)).
  std::vector<ProbeSet> ProbeSets() const override {
    if (parameters().size() < 2) return Effect::ProbeSets();
    return {{{{0.0, 0.0}, 0, 0.0}, {{0.0, 1.0}, 0, 0.0}}};
  }
  std::vector<double> FromProbes(
      const ProbeSet& probes,
      const std::vector<double>& weights) const override {
    if (parameters().size() < 2) return Effect::FromProbes(probes, weights);
    double stiffness = 0.0, moment = 0.0;
    for (size_t i = 0; i < probes.size(); ++i) {
      stiffness += weights[i];
      moment += weights[i] * probes[i].at[1];
    }
    return {stiffness, stiffness != 0.0 ? moment / stiffness : 0.0};
  }
};

}  // namespace sysid
