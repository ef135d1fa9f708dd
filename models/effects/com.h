#pragma once

#include <string>

#include "models/effects/effect.h"

namespace sysid {

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

}  // namespace sysid
