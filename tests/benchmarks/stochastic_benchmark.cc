#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/stochastic/rollout_gradient.h"
#include "sysid/stochastic/stochastic_fit.h"
#include "tests/support/fit_setup.h"
#include "tests/support/tape_gradient.h"

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

// Seconds of the processor, of all threads: other processes want the core too.
double CpuTime() {
  std::timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double Median(std::vector<double> values) {
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Three lengths, semi-implicit Euler with a step a sample, as the paper has it.
struct Pendulum {
  std::unique_ptr<ShootingProblem> problem;
  std::unique_ptr<Rollouts> rollouts;
  std::unique_ptr<Transformation> transformation;

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
  }

  double Plain() const {
    return rollouts->Loss(rollouts->size(), problem->InitialTheta(), INFINITY);
  }

  // Seconds, the median of several.
  double PlainTime() const {
    std::vector<double> rounds(5);
    for (double& round : rounds) {
      constexpr int kCalls = 50;
      const double start = CpuTime();
      for (int i = 0; i < kCalls; ++i) benchmark::DoNotOptimize(Plain());
      round = (CpuTime() - start) / kCalls;
    }
    return Median(rounds);
  }
};

void BM_PlainRollout(benchmark::State& state) {
  const Pendulum pendulum(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(pendulum.Plain());
}
BENCHMARK(BM_PlainRollout)->Arg(10)->Arg(250);

// `gradient`: evaluates one, false where it fails.
template <class Function>
void Gradient(benchmark::State& state, const Function& gradient) {
  const Pendulum pendulum(static_cast<int>(state.range(0)));
  const Eigen::VectorXd v = Eigen::VectorXd::Zero(3);
  double plain = pendulum.PlainTime();
  std::size_t bytes = 0;
  std::vector<double> times;
  for (auto _ : state) {
    const double start = CpuTime();
    if (!gradient(pendulum, v, &bytes)) {
      state.SkipWithError("the rollout failed");
    }
    times.push_back(CpuTime() - start);
  }
  plain = 0.5 * (plain + pendulum.PlainTime());
  state.counters["rollout_us"] = 1e6 * plain;
  state.counters["ratio"] = Median(times) / plain;
  state.counters["tape_kB"] = 1e-3 * static_cast<double>(bytes);
}
void BM_PrecomputedGradient(benchmark::State& state) {
  RolloutSums sums;
  Eigen::ArrayXXd gradient;
  Gradient(state, [&](const Pendulum& pendulum, const Eigen::VectorXd& v,
                      std::size_t* bytes) {
    double loss = 0.0;
    int failed = 0;
    const bool ok = MeanLossGradient(
        *pendulum.rollouts, pendulum.rollouts->size(), *pendulum.transformation,
        INFINITY, v.transpose(), &sums, &loss, &failed, &gradient);
    *bytes = LastTapeUse().last_call;
    return ok;
  });
}
void BM_TapeGradient(benchmark::State& state) {
  Eigen::VectorXd gradient;
  Gradient(state, [&](const Pendulum& pendulum, const Eigen::VectorXd& v,
                      std::size_t* bytes) {
    double loss = 0.0;
    return LossGradientByTape(*pendulum.rollouts, *pendulum.transformation,
                              INFINITY, v, &loss, &gradient, bytes);
  });
}
BENCHMARK(BM_PrecomputedGradient)->Arg(10)->Arg(50)->Arg(250)->Arg(1000);
BENCHMARK(BM_TapeGradient)->Arg(10)->Arg(50)->Arg(250)->Arg(1000);

// What the mixture does in an epoch: draws, the gradient, a step of Adam.
class MixtureEpochs {
 public:
  explicit MixtureEpochs(int steps)
      : pendulum_(steps),
        random_(1),
        mixture_(StartingMixture(options_.kernels, kParameters, 0.1, &random_)),
        adam_(static_cast<int>(mixture_.Pack().size()), options_.adam),
        rollout_(pendulum_.rollouts->functor(0)),
        x0_(pendulum_.rollouts->first_state(0)),
        errors_(rollout_.num_residuals()),
        end_(rollout_.model().state_size()) {}

  // One by so many threads. The mixture stays where it is.
  void Epoch(int threads) {
    DrawNoise(options_.draws, options_.kernels, kParameters, &random_, &noise_);
    draws_.Draw(mixture_, noise_, options_.temperature);
    EstimationOptions options = pendulum_.problem->options();
    if (options.threads != threads) {
      options.threads = threads;
      *pendulum_.problem = pendulum_.problem->With(options);
    }
    double loss = 0.0;
    int failed = 0;
    ok_ = MeanLossGradient(*pendulum_.rollouts, pendulum_.rollouts->size(),
                           *pendulum_.transformation, options_.huber,
                           draws_.v(), &sums_, &loss, &failed, &by_v_) &&
          failed == 0;
    Eigen::VectorXd packed = mixture_.Pack();
    adam_.Step(draws_.Gradient(by_v_), options_.adam.learning_rate, &packed);
    benchmark::DoNotOptimize(packed.data());
  }

  // The plain rollouts of the last epoch's draws, one thread.
  void PlainRollouts() {
    for (const Eigen::VectorXd& theta : thetas_) {
      ok_ = rollout_(x0_, theta.data(), errors_.data(), end_.data()) && ok_;
    }
  }
  void PreparePlainRollouts() {
    thetas_.clear();
    for (int d = 0; d < draws_.count(); ++d) {
      thetas_.push_back(
          pendulum_.transformation->Theta(draws_.v().row(d).matrix()));
    }
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
  MixtureNoise noise_;
  SoftDraws draws_;
  RolloutSums sums_;
  Eigen::ArrayXXd by_v_;
  // Of the plain rollouts.
  SegmentRollout rollout_;
  const double* x0_;
  std::vector<double> errors_, end_;
  std::vector<Eigen::VectorXd> thetas_;
  bool ok_ = true;
};

// What `work` takes by a clock, in seconds.
template <class Clock, class Work>
double Took(Clock clock, Work work) {
  const double start = clock();
  work();
  return clock() - start;
}

// Epochs and plain rollouts by turns: what slows the machine slows both.
void BM_MixtureEpoch(benchmark::State& state) {
  MixtureEpochs epochs(static_cast<int>(state.range(0)));
  std::vector<double> epoch, plain;
  for (auto _ : state) {
    epoch.push_back(Took(CpuTime, [&] { epochs.Epoch(1); }));
    state.PauseTiming();
    epochs.PreparePlainRollouts();
    plain.push_back(Took(CpuTime, [&] { epochs.PlainRollouts(); }));
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

// By the wall clock: it wants a machine that does nothing else.
void BM_MixtureEpochTwoThreads(benchmark::State& state) {
  MixtureEpochs epochs(static_cast<int>(state.range(0)));
  std::vector<double> two, one;
  for (auto _ : state) {
    two.push_back(Took(Now, [&] { epochs.Epoch(2); }));
    state.PauseTiming();
    one.push_back(Took(Now, [&] { epochs.Epoch(1); }));
    state.ResumeTiming();
  }
  state.counters["epochs_s"] = 1.0 / Median(two);
  state.counters["speedup"] = Median(one) / Median(two);
}
// Ten steps a draw are not worth a thread.
BENCHMARK(BM_MixtureEpochTwoThreads)->Arg(250)->Arg(1000)->UseRealTime();

}  // namespace
}  // namespace sysid

BENCHMARK_MAIN();
