#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
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
//   rollout_us  time of the plain rollout of the same samples; of an epoch, of
//               one of its draws, by the median
//   ratio       time of the line over it; of an epoch, over the plain rollouts
//               of all its draws
//   tape_kB     of Stan's tape at the end of a gradient (blocks of it, which
//               double)
//   epochs_s    epochs a second
//   speedup     of an epoch by two threads over one, medians of wall time

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

double Median(std::vector<double> values) {
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// What the mixture does in an epoch: draws, the gradient, a step of Adam.
class MixtureEpochs {
 public:
  explicit MixtureEpochs(int steps)
      : pendulum_(steps),
        random_(1),
        mixture_(StartingMixture(options_.kernels, kParameters, 0.1, &random_)),
        adam_(static_cast<int>(mixture_.Pack().size()), options_.adam) {}

  // Seconds of one by so many threads. The mixture stays where it is.
  double Epoch(int threads) {
    const double start = Now();
    draws_.clear();
    for (int d = 0; d < options_.draws; ++d) {
      draws_.push_back(DrawNoise(options_.kernels, kParameters, &random_));
    }
    options_.loss.threads = threads;
    double loss = 0.0;
    int failed = 0;
    ok_ = MixtureLossGradient(*pendulum_.rollouts, pendulum_.all,
                              *pendulum_.transformation, options_.loss,
                              mixture_, options_.temperature, draws_, &loss,
                              &failed, &gradient_) &&
          failed == 0;
    Eigen::VectorXd packed = mixture_.Pack();
    adam_.Step(gradient_, options_.adam.learning_rate, &packed);
    benchmark::DoNotOptimize(packed.data());
    return Now() - start;
  }

  // Seconds of the plain rollouts of the last epoch's draws, one thread.
  double PlainRollouts() {
    const SegmentRollout rollout = pendulum_.rollouts->functor(0);
    const double* x0 = pendulum_.rollouts->first_state(0);
    std::vector<double> errors(rollout.num_residuals());
    std::vector<double> end(rollout.model().state_size());
    const Eigen::VectorXd packed = mixture_.Pack();
    const int K = mixture_.kernels();
    std::vector<Eigen::VectorXd> thetas;
    for (const MixtureDraw& draw : draws_) {
      Eigen::VectorXd v(kParameters);
      SoftDraw<double>(K, kParameters, packed.data(), packed.data() + K,
                       packed.data() + K + K * kParameters, draw,
                       options_.temperature, v.data());
      thetas.push_back(pendulum_.transformation->Theta(v));
    }
    const double start = Now();
    for (const Eigen::VectorXd& theta : thetas) {
      ok_ = rollout(x0, theta.data(), errors.data(), end.data()) && ok_;
    }
    return Now() - start;
  }

  int draws() const { return options_.draws; }
  // Whether all of the last ones succeeded.
  bool ok() const { return ok_; }

 private:
  static constexpr int kParameters = 3;
  Pendulum pendulum_;
  MixtureOptions options_;
  std::mt19937_64 random_;
  GaussianMixture mixture_;
  Adam adam_;
  std::vector<MixtureDraw> draws_;
  Eigen::VectorXd gradient_;
  bool ok_ = true;
};

// Epochs and plain rollouts by turns: what slows the machine slows both.
void BM_MixtureEpoch(benchmark::State& state) {
  MixtureEpochs epochs(static_cast<int>(state.range(0)));
  std::vector<double> epoch, plain;
  for (auto _ : state) {
    epoch.push_back(epochs.Epoch(1));
    state.PauseTiming();
    plain.push_back(epochs.PlainRollouts());
    if (!epochs.ok()) state.SkipWithError("a rollout failed");
    state.ResumeTiming();
  }
  if (epoch.empty()) return;
  state.counters["rollout_us"] = 1e6 * Median(plain) / epochs.draws();
  state.counters["ratio"] = Median(epoch) / Median(plain);
  state.counters["epochs_s"] = 1.0 / Median(epoch);
  state.counters["tape_kB"] =
      1e-3 * static_cast<double>(LastTapeUse().last_call);
}
BENCHMARK(BM_MixtureEpoch)->Arg(10)->Arg(250);

void BM_MixtureEpochTwoThreads(benchmark::State& state) {
  MixtureEpochs epochs(static_cast<int>(state.range(0)));
  std::vector<double> two, one;
  for (auto _ : state) {
    two.push_back(epochs.Epoch(2));
    state.PauseTiming();
    one.push_back(epochs.Epoch(1));
    state.ResumeTiming();
  }
  state.counters["epochs_s"] = 1.0 / Median(two);
  state.counters["speedup"] = Median(one) / Median(two);
}
BENCHMARK(BM_MixtureEpochTwoThreads)->Arg(10)->Arg(250)->UseRealTime();

}  // namespace
}  // namespace sysid

BENCHMARK_MAIN();
