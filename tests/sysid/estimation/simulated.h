#pragma once

#include <string>

#include "sysid/simulation/simulate.h"

namespace sysid {

// A run from a random state of this size.
inline Run Simulated(const Model& model, double amplitude, int seed,
                     double duration = 5.0, double noise = 1e-3,
                     Excitation excitation = Excitation::kNone) {
  SimulationOptions options;
  options.duration = duration;
  options.noise = noise;
  options.seed = seed;
  options.excitation = excitation;
  Run run = Simulate(model, RandomState(model, amplitude, seed), options);
  run.name = "run" + std::to_string(seed) + ".csv";
  return run;
}

}  // namespace sysid
