#pragma once

#include <string>

#include "models/effects/effect.h"

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

}  // namespace sysid
