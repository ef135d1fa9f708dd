#pragma once

#include <string>
#include <vector>

#include "tests/support/fit_setup.h"

namespace sysid {

// A planar arm of two links whose inertial parameters are free, with viscous
// and Coulomb friction on both joints, and a recording of it.

inline Model FrictionArm(double coulomb) {
  return Shipped("pendulum2_planar",
                 {"viscous_damping@joint1", "viscous_damping@joint2",
                  "coulomb_friction@joint1", "coulomb_friction@joint2"},
                 {{"joint1.damping", 0.05},
                  {"joint2.damping", 0.03},
                  {"joint1.friction", coulomb},
                  {"joint2.friction", 0.5 * coulomb}});
}

inline std::vector<std::string> AllOf(const std::vector<std::string>& links) {
  std::vector<std::string> names;
  for (const std::string& link : links) {
    for (const char* name : {"mass", "com_x", "com_y", "com_z", "ixx", "iyy",
                             "izz", "ixy", "ixz", "iyz"}) {
      names.push_back(link + "." + name);
    }
  }
  return names;
}

// These parameters, from their nominal values.
inline std::vector<FreeParameter> FreeNominal(
    const Model& model, const std::vector<std::string>& names) {
  std::vector<Value> values;
  for (const Parameter& p : FindParameters(model, names, "test")) {
    values.push_back({p.name, p.nominal});
  }
  return FreeFrom(model, values);
}

inline Run Shaken(const Model& model, double noise, std::uint64_t seed,
                  double duration = 20.0) {
  SimulationOptions options;
  options.duration = duration;
  options.rate = 200.0;
  options.noise = noise;
  options.seed = seed;
  options.excitation = Excitation::kMultisine;
  options.excitation_level = 0.5;
  options.step = 1e-3;  // a microradian off
  return Simulate(model, RandomState(model, 0.5, seed), options);
}

}  // namespace sysid
