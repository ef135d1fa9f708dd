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

// The same with other free parameters.
inline std::unique_ptr<ShootingProblem> Freeing(
    const ShootingProblem& problem, std::vector<FreeParameter> free) {
  std::vector<Run> runs;
  for (const auto& run : problem.runs()) runs.push_back(run->run);
  return std::make_unique<ShootingProblem>(problem.model(), std::move(free),
                                           std::move(runs), problem.options());
}

// A problem of which only what is free matters.
inline std::unique_ptr<ShootingProblem> AnyRunOf(
    const Model& model, std::vector<FreeParameter> free) {
  EstimationOptions options;
  options.noise = 1e-3;
  return std::make_unique<ShootingProblem>(
      model, std::move(free), ReleasedRuns(model, 1, 0.2, 0.0, 1), options);
}

// A double pendulum with dampings of 0.05 and 0.02 N m s/rad.
inline std::unique_ptr<ShootingProblem> TwoDampings(
    const std::vector<Value>& start, double duration) {
  const std::vector<std::string> damped{"viscous_damping@joint1",
                                        "viscous_damping@joint2"};
  const Model truth =
      Shipped("pendulum2", damped,
              {{"joint1.damping", 0.05}, {"joint2.damping", 0.02}});
  const Model model = Shipped("pendulum2", damped);
  EstimationOptions options;
  options.noise = 1e-3;
  return std::make_unique<ShootingProblem>(
      model, FreeFrom(model, start), ReleasedRuns(truth, 1, duration, 1e-3, 1),
      options);
}

// A damping that a step so long cannot follow.
inline std::unique_ptr<ShootingProblem> StiffDamping(double damping,
                                                     double step,
                                                     double duration) {
  const Model model = Shipped("pendulum2", {"viscous_damping@joint1"});
  EstimationOptions options;
  options.noise = 1e-3;
  options.rollout = {Integrator::kRungeKutta4, step};
  return std::make_unique<ShootingProblem>(
      model, FreeFrom(model, {{"joint1.damping", damping}}),
      ReleasedRuns(Shipped("pendulum2"), 1, duration, 1e-3, 1), options);
}

// A bar that swings with one period about either of two points 0.15 and 0.4 m
// from its centre of mass (Kater's pendulum: their product is I / m), its
// centre of mass free, from between the two.
inline std::unique_ptr<ShootingProblem> TwoCentresOfMass() {
  const std::vector<Value> bar{{"bob.ixx", 0.06}, {"bob.iyy", 0.06}};
  Model truth = Shipped("rod_and_bob", {}, bar);  // the rod is 0.5 m
  Set({{"bob.com_z", 0.35}}, &truth);
  const Model model = Shipped("rod_and_bob", {}, bar);
  EstimationOptions options;
  options.noise = 1e-3;
  return std::make_unique<ShootingProblem>(
      model, FreeFrom(model, {{"bob.com_z", 0.25}}),
      ReleasedRuns(truth, 1, 2.0, 1e-3, 1), options);
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
