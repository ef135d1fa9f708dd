#pragma once

#include <string>

#include "models/effects/effect.h"

namespace sysid {

// The inertia of a rotor that turns with the joint (reflected through its
// gear), on the diagonal of the joint-space inertia. kg m^2, or kg on a slide.
class Armature : public EffectOf<Armature> {
 public:
  static constexpr char kName[] = "armature";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] = "-I qdd, the inertia of a rotor";
  static constexpr char kShowsIn[] =
      "quick changes of speed beside slow motion against gravity";

  Armature(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kJointInertiaHook, mechanism, joint) {
    AddParameter(joint + ".armature", IsPrismatic() ? "kg" : "kg m^2", 0.01,
                 0.0);
  }

  template <typename T>
  void AddJointInertia(const T* p, T* inertia) const {
    *inertia += p[0];
  }
};

}  // namespace sysid
