#pragma once

#include <cmath>
#include <string>

#include "models/effects/effect.h"

namespace sysid {

// Friction whose asperities bend before they slip (Dahl 1968; an elasto-plastic
// element): with the bend z, from -1 to 1, over the length l,
//   -c z,   l z' = qd - |qd| z.
// About rest it is a spring of c / l, after some l one way it is c. z depends
// on the way of the joint alone, and is known exactly after any part of it in
// one direction: with s its sign, z -> s + (z - s) exp(-|dq| / l). A step takes
// the part that leads to each of its stages for one.
class PreslidingFriction : public EffectOf<PreslidingFriction> {
 public:
  static constexpr char kName[] = "presliding_friction";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] = "-c z, l z' = qd - |qd| z";
  static constexpr char kShowsIn[] =
      "reversals, and moves as short as the friction bends";
  // Five lengths for each joint, and Coulomb friction beside it.
  static constexpr bool kOnlyNamed = true;

  PreslidingFriction(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kEffortHook | kMoveStateHook, mechanism, joint) {
    const double unit = IsPrismatic() ? 0.1 : 1.0;
    AddParameter(joint + ".presliding_friction", "{effort}", 0.01, 0.0);
    AddSearchedParameter(
        joint + ".presliding_length", "{position}", 0.01 * unit,
        {0.001 * unit, 0.003 * unit, 0.01 * unit, 0.03 * unit, 0.1 * unit},
        1e-6 * unit, 10.0 * unit);
    AddState(joint + ".presliding", "-", 1.0);
  }

  static bool Applies(JointType type) { return type != JointType::kSpherical; }

  template <typename T>
  void AddEffort(const JointState<T>& joint, const T* p, T* tau) const {
    tau[0] -= p[0] * joint.z[0];
  }

  template <typename T>
  void MoveState(const JointState<T>& from, const JointState<T>& to, const T* p,
                 T* z) const {
    using std::exp;
    const T way = to.q[0] - from.q[0];
    const double sign = ValueOf(way) < 0.0 ? -1.0 : 1.0;
    z[0] = (z[0] - sign) * exp(-sign * way / p[1]) + sign;
  }
};

}  // namespace sysid
