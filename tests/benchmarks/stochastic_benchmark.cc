#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/stochastic/stochastic_fit.h"
#include "tests/support/fit_setup.h"

// What the gradients of the stochastic solvers cost, in plain rollouts measured
// beside them (seconds differ between machines, this ratio hardly does), and
// what they leave on the tape. scripts/benchmark prints the table.
//
// Counters:
//   rollout_us  time of the plain rollout of the same samples
//   ratio       time of the line over it
//   tape_kB     of Stan's tape at the end of a gradient (blocks of it, which
//               double)
//   epochs_s    epochs a second

namespace sysid {
namespace {

constexpr double kRate = 25.0;  // Hz, the paper's

// Three lengths, semi-implicit Euler with a step a sample, as the paper has it.
struct Pendulum {
  std::unique_ptr<ShootingProblem> problem;
  std::unique_ptr<Rollouts> rollouts;
  std::unique_ptr<Transformation> transformation;
  std::vector<int> all;

  explicit Pendulum(int steps) {
    const Model model = Shipped("pendulum3");
    SimulationOptions simulation;
    simulation.rate = kRate;
    simulation.duration = steps / kRate;
    simulation.noise = 1e-3;
    EstimationOptions options;
    options.noise = 1e-3;
    options.rollout = {Integrator::kSemiImplicitEuler, 1.0 / kRate};
    problem = std::make_unique<ShootingProblem>(
        model,
        FreeFrom(model, {{"link1.length", 0.45},
                         {"link2.length", 0.55},
                         {"link3.length", 0.5}}),
        std::vector<Run>{
            Simulate(model, RandomState(model, 0.3, 1), simulation)},
        options);
    rollouts = std::make_unique<Rollouts>(
        problem.get(), CutPoint(*problem, problem->InitialTheta(),
                                {StatesFromData(*problem, 0)}, 1e9));
    transformation = std::make_unique<Transformation>(*problem);
    all = FirstOnes(rollouts->size());
  }

  double Plain() const {
    return rollouts->Loss(all, problem->InitialTheta(), INFINITY);
  }

  // Seconds, the least of several: other processes want the core too.
  double PlainTime() const {
    double least = INFINITY;
    for (int round = 0; round < 5; ++round) {
      constexpr int kCalls = 50;
      const double start = Now();
      for (int i = 0; i < kCalls; ++i) benchmark::DoNotOptimize(Plain());
      least = std::min(least, (Now() - start) / kCalls);
    }
    return least;
  }
};

void BM_PlainRollout(benchmark::State& state) {
  const Pendulum pendulum(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(pendulum.Plain());
}
BENCHMARK(BM_PlainRollout)->Arg(10)->Arg(250);

void Gradient(benchmark::State& state, GradientWay way) {
  const Pendulum pendulum(static_cast<int>(state.range(0)));
  LossOptions options;
  options.way = way;
  const Eigen::VectorXd v = Eigen::VectorXd::Zero(3);
  Eigen::VectorXd gradient;
  double loss = 0.0, plain = pendulum.PlainTime(), least = INFINITY;
  for (auto _ : state) {
    const double start = Now();
    if (!LossGradient(*pendulum.rollouts, pendulum.all,
                      *pendulum.transformation, options, v, &loss, &gradient)) {
      state.SkipWithError("the rollout failed");
    }
    least = std::min(least, Now() - start);
  }
  plain = std::min(plain, pendulum.PlainTime());
  state.counters["rollout_us"] = 1e6 * plain;
  state.counters["ratio"] = least / plain;
  state.counters["tape_kB"] =
      1e-3 * static_cast<double>(LastTapeUse().last_call);
}
void BM_PrecomputedGradient(benchmark::State& state) {
  Gradient(state, GradientWay::kPrecomputed);
}
void BM_TapeGradient(benchmark::State& state) {
  Gradient(state, GradientWay::kTape);
}
BENCHMARK(BM_PrecomputedGradient)->Arg(10)->Arg(50)->Arg(250)->Arg(1000);
BENCHMARK(BM_TapeGradient)->Arg(10)->Arg(50)->Arg(250)->Arg(1000);

void BM_MixtureEpoch(benchmark::State& state) {
  const Pendulum pendulum(static_cast<int>(state.range(0)));
  const MixtureOptions options;
  std::mt19937_64 random(1);
  const GaussianMixture mixture =
      StartingMixture(options.kernels, 3, 0.1, &random);
  std::vector<MixtureDraw> draws;
  for (int d = 0; d < options.draws; ++d) {
    draws.push_back(DrawNoise(options.kernels, 3, &random));
  }
  Eigen::VectorXd gradient;
  double loss = 0.0;
  int failed = 0;
  for (auto _ : state) {
    MixtureLossGradient(*pendulum.rollouts, pendulum.all,
                        *pendulum.transformation, options.loss, mixture,
                        options.temperature, draws, &loss, &failed, &gradient);
  }
  state.counters["epochs_s"] = benchmark::Counter(
      static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["tape_kB"] =
      1e-3 * static_cast<double>(LastTapeUse().last_call);
}
BENCHMARK(BM_MixtureEpoch)->Arg(10)->Arg(250);

}  // namespace
}  // namespace sysid

BENCHMARK_MAIN();
