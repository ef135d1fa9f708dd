#pragma once

#include <string>

#include "models/effects/coulomb_friction.h"
#include "models/effects/effect.h"

namespace sysid {

// Dry friction of a hinge or slide beside a smooth force: a law has its level,
//   template <typename T>
//   T DryFriction(const JointState<T>&, const T* p, const T& speed) const;
// and, with kBesideDryHook, AddBesideDry. Smoothed (coulomb_friction.h) it is
//   tau = -level(qd) qd / sqrt(qd^2 + v_s^2) and the force beside it.
template <class Derived>
class HingeFriction : public EffectOf<Derived> {
 public:
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static bool Applies(JointType type) { return type != JointType::kSpherical; }

  template <typename T>
  void AddEffort(const JointState<T>& joint, const T* p, T* tau) const {
    const Derived& law = static_cast<const Derived&>(*this);
    const T& qd = joint.qd[0];
    tau[0] -= law.template DryFriction<T>(joint, p, qd) *
              SmoothSign(qd, smoothing_speed_);
    law.template AddBesideDry<T>(joint, p, tau);
  }

 protected:
  // `hooks`: beside those of dry friction.
  HingeFriction(const char* kind, unsigned hooks, const Mechanism& mechanism,
                const std::string& joint)
      : EffectOf<Derived>(kind, kEffortHook | kDryFrictionHook | hooks,
                          mechanism, joint),
        smoothing_speed_(FrictionSmoothingSpeed(this->IsPrismatic())) {}

 private:
  double smoothing_speed_;
};

}  // namespace sysid
