#pragma once

#include <cmath>
#include <string>

#include "models/effects/effect.h"

namespace sysid {

// Force -b |v| v at the link's centre of mass, v its velocity in the world;
// b in N s^2/m^2.
class AerodynamicDrag : public EffectOf<AerodynamicDrag> {
 public:
  static constexpr char kName[] = "aerodynamic_drag";
  static constexpr TargetKind kTarget = TargetKind::kLink;
  static constexpr char kLaw[] = "-b |v| v at the centre of mass";
  static constexpr char kShowsIn[] =
      "slow and fast motion of the link, by other joints too";

  AerodynamicDrag(const Mechanism& mechanism, const std::string& link)
      : EffectOf(kName, kLinkForceHook, mechanism, link) {
    AddParameter(link + ".drag", "N s^2/m^2", 0.01, 0.0);
  }

  template <typename T>
  void AddLinkForce(const LinkState<T>& link, const T* p,
                    Vector3<T>* force) const {
    using std::sqrt;
    // Smooth about rest, within 0.01 m/s, where it brakes nothing.
    const T speed = sqrt(link.v_com.squaredNorm() + T(1e-4));
    *force -= link.v_com * (p[0] * speed);
  }
};

}  // namespace sysid
