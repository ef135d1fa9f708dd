#pragma once

#include <cmath>
#include <string>

#include "models/effects/effect.h"

namespace sysid {

// The nominal rotational inertia of a link is wrong. Of a link that turns about
// one direction only, one moment shows, whose size the scale is: alone, an
// entry could not leave what the others allow a body.
class WrongInertia : public EffectOf<WrongInertia> {
 public:
  static constexpr char kName[] = "inertia";
  static constexpr TargetKind kTarget = TargetKind::kLink;
  static constexpr char kLaw[] = "another rotational inertia of the link";
  static constexpr char kShowsIn[] =
      "quick changes of speed beside slow motion against gravity";

  WrongInertia(const Mechanism& mechanism, const std::string& link)
      : EffectOf(kName, 0, mechanism, link) {
    if (TurnsAboutOneDirection(mechanism, this->link())) {
      AdjustsNominal(link + ".inertia_scale");
      return;
    }
    for (const char* entry : {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"}) {
      AdjustsNominal(link + "." + entry);
    }
  }

 private:
  // Whether the hinges between the link and the world are all parallel.
  static bool TurnsAboutOneDirection(const Mechanism& mechanism, int link) {
    int hinges = 0;
    Eigen::Vector3d direction;  // of the last hinge so far, in link's axes
    for (; link > 0; link = mechanism.joints[link - 1].parent_link) {
      const Joint& joint = mechanism.joints[link - 1];
      if (joint.type == JointType::kSpherical) return false;
      if (IsRotation1(joint.type)) {
        constexpr double kParallel = 1e-9;
        if (hinges > 0 && joint.axis.cross(direction).norm() > kParallel) {
          return false;
        }
        direction = joint.axis;
        ++hinges;
      }
      if (hinges > 0) direction = joint.R_PJ * direction;
    }
    return hinges > 0;
  }
};

}  // namespace sysid
