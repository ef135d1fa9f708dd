#pragma once

#include <string>

#include "models/effects/effect.h"

namespace sysid {

// The nominal rotational inertia of a link is wrong.
class WrongInertia : public EffectOf<WrongInertia> {
 public:
  static constexpr char kName[] = "inertia";
  static constexpr TargetKind kTarget = TargetKind::kLink;
  static constexpr char kShowsIn[] =
      "quick changes of speed beside slow motion against gravity";

  WrongInertia(const Mechanism& mechanism, const std::string& link)
      : EffectOf(kName, 0, mechanism, link) {
    for (const char* entry : {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"}) {
      Corrects(link + "." + entry);
    }
  }
};

}  // namespace sysid
