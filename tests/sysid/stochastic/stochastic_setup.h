#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sysid/stochastic/stochastic_fit.h"
#include "tests/support/fit_setup.h"

namespace sysid {

// Runs released from rest, as figures 1 and 2 of the paper have them: `runs` of
// `duration` seconds at 25 Hz, one seed each.
inline std::vector<Run> ReleasedRuns(const Model& truth, int runs,
                                     double duration, double noise,
                                     std::uint64_t seed) {
  std::vector<Run> released;
  for (int i = 0; i < runs; ++i) {
    SimulationOptions simulation;
    simulation.duration = duration;
    simulation.rate = 25.0;
    simulation.noise = noise;
    simulation.seed = 100 * seed + i;
    released.push_back(
        Simulate(truth, RandomState(truth, 0.6, simulation.seed), simulation));
    released.back().name = "run" + std::to_string(i);
  }
  return released;
}

// A double pendulum whose lengths are 0.4 and 0.3 m, started at 0.5 m.
inline std::unique_ptr<ShootingProblem> TwoLengths(double noise = 1e-3,
                                                   int runs = 1) {
  const Model truth =
      Shipped("pendulum2", {}, {{"link1.length", 0.4}, {"link2.length", 0.3}});
  const Model model = Shipped("pendulum2");
  EstimationOptions options;
  options.noise = 1e-3;
  options.rollout.step = 0.02;
  return std::make_unique<ShootingProblem>(
      model, FreeFrom(model, {{"link1.length", 0.5}, {"link2.length", 0.5}}),
      ReleasedRuns(truth, runs, 0.6, noise, 1), options);
}

// A rod and a bob whose shares of one distance no swing tells apart.
inline std::unique_ptr<ShootingProblem> RodAndBob() {
  const Model truth =
      Shipped("rod_and_bob", {}, {{"rod.length", 0.6}, {"bob.com_z", -0.15}});
  const Model model = Shipped("rod_and_bob");
  EstimationOptions options;
  options.noise = 1e-3;
  return std::make_unique<ShootingProblem>(
      model, FreeFrom(model, {{"rod.length", 0.5}, {"bob.com_z", -0.1}}),
      ReleasedRuns(truth, 1, 2.0, 1e-3, 1), options);
}

}  // namespace sysid
