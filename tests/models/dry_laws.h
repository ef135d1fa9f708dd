#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/models/dry_two_links.h"

namespace sysid {

inline Model WithEffects(
    const Mechanism& mechanism, const std::vector<std::string>& effects,
    const std::vector<std::pair<std::string, double>>& values) {
  Model model(mechanism);
  for (const std::string& effect : effects) {
    model.AddEffect(Catalogue().Make(effect, mechanism, "test"));
  }
  for (const auto& [name, value] : values) {
    model.SetEffectParameter(name, value);
  }
  return model;
}

// A joint on the world that carries 2 kg (or 2 kg m^2).
inline Mechanism OneJoint(JointType type, const Eigen::Vector3d& axis) {
  Mechanism mechanism;
  mechanism.AddRoot("base");
  mechanism.AddJoint(
      MakeJoint("joint", type, 0, axis), "body", Eigen::Vector3d::Zero(),
      Body(2.0, Eigen::Vector3d::Zero(), Eigen::Vector3d(2, 2, 2)));
  return mechanism;
}

inline Model CoulombTwoLinks() {
  return WithEffects(TwoLinks::Make(),
                     {"coulomb_friction@joint1", "coulomb_friction@joint2"},
                     {{"joint1.friction", 0.4}, {"joint2.friction", 0.15}});
}

inline Model StribeckTwoLinks() {
  return WithEffects(TwoLinks::Make(),
                     {"stribeck_friction@joint1", "stribeck_friction@joint2"},
                     {{"joint1.friction", 0.25},
                      {"joint1.static_friction", 0.4},
                      {"joint1.stribeck_velocity", 0.8},
                      {"joint2.friction", 0.1},
                      {"joint2.static_friction", 0.15},
                      {"joint2.stribeck_velocity", 1.0}});
}

inline double CoulombLevel(int joint, double) {
  return joint == 0 ? 0.4 : 0.15;
}
inline double StribeckLevel(int joint, double speed) {
  const double v = joint == 0 ? 0.8 : 1.0;
  const double e = std::exp(-speed * speed / (v * v));
  return joint == 0 ? 0.25 + 0.15 * e : 0.1 + 0.05 * e;
}

// Efforts of both joints, held for 20 ms: they let the first come to rest and
// push it loose again.
inline Eigen::Vector2d Push(double t) {
  return {t < 2.8 ? 0.3 * std::sin(2.1 * t) : std::sin(7.0 * (t - 2.8)),
          0.3 * std::sin(3.7 * t + 1.0)};
}

inline const Eigen::Vector4d kStart(0.5, -0.6, 0.4, -0.9);

struct Law {
  const char* name;
  Model (*make)();
  double (*level)(int, double);
};
class DryFrictionLaws : public testing::TestWithParam<Law> {};

}  // namespace sysid
