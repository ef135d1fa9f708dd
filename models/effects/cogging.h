#pragma once

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "models/effects/effect.h"

namespace sysid {

// tau = a sin(n q) + b cos(n q), N m: a motor's detents, a gear's eccentricity;
// n, how many there are in a turn, is searched.
class Cogging : public EffectOf<Cogging> {
 public:
  static constexpr char kName[] = "cogging";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] = "a sin(n q) + b cos(n q)";
  static constexpr char kShowsIn[] = "slow motion through whole turns";
  static constexpr bool kNeedsDrive = true;
  static constexpr int kMostDetents = 24;

  Cogging(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kEffortHook, mechanism, joint) {
    AddParameter(joint + ".cogging_sin", "{effort}", 0.01);
    AddParameter(joint + ".cogging_cos", "{effort}", 0.01);
    // Not one: in gravity that is a wrong centre of mass (com.h).
    std::vector<double> orders(kMostDetents - 1);
    std::iota(orders.begin(), orders.end(), 2.0);
    AddSearchedParameter(joint + ".cogging_order", "-", 6.0, orders, 1.0,
                         1000.0, true);
  }

  static bool Applies(JointType type) { return IsRotation1(type); }

  template <typename T>
  void AddEffort(const JointState<T>& joint, const T* p, T* tau) const {
    using std::cos;
    using std::sin;
    const T angle = p[2] * joint.q[0];
    tau[0] += p[0] * sin(angle) + p[1] * cos(angle);
  }
};

}  // namespace sysid
