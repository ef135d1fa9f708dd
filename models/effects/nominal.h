#pragma once

#include <cmath>
#include <string>

#include "models/effects/effect.h"

// What may be wrong with the nominal values of a link: these free parameters of
// the mechanism and have none of their own.

namespace sysid {

// The nominal mass of a link is wrong: a payload, a wrong data sheet.
class WrongMass : public EffectOf<WrongMass> {
 public:
  static constexpr char kName[] = "mass";
  static constexpr TargetKind kTarget = TargetKind::kLink;
  static constexpr char kLaw[] = "another mass of the link";
  static constexpr char kShowsIn[] =
      "motion with other loads or drives: passive swings hide a mass";

  WrongMass(const Mechanism& mechanism, const std::string& link)
      : EffectOf(kName, 0, mechanism, link) {
    AdjustsNominal(link + ".mass");
  }
};

// The nominal centre of mass of a link is wrong.
class WrongCom : public EffectOf<WrongCom> {
 public:
  static constexpr char kName[] = "com";
  static constexpr TargetKind kTarget = TargetKind::kLink;
  static constexpr char kLaw[] = "another centre of mass of the link";
  static constexpr char kShowsIn[] =
      "slow motion against gravity through many positions";

  WrongCom(const Mechanism& mechanism, const std::string& link)
      : EffectOf(kName, 0, mechanism, link) {
    AdjustsNominal(link + ".com_x");
    AdjustsNominal(link + ".com_y");
    AdjustsNominal(link + ".com_z");
  }
};

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
