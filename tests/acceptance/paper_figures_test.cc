// What issue 4 promises of the two experiments of Heiden et al., "Real2Sim
// Transfer using Differentiable Physics". Their recordings are not public:
// synthetic stand-ins play their part.

#include <gmock/gmock.h>

#include <cmath>

#include "sysid/stochastic/comparison.h"
#include "tests/sysid/stochastic/stochastic_setup.h"

namespace sysid {
namespace {

const std::vector<std::string> kDamping{"viscous_damping@joint1",
                                        "viscous_damping@joint2"};
const std::vector<double> kLengths{0.810, 0.304};

// 10 steps at 25 Hz of a damped double pendulum, released from rest.
Run Figure1Run(double noise, int seed) {
  const Model truth = Shipped("pendulum2", kDamping,
                              {{"link1.length", kLengths[0]},
                               {"link2.length", kLengths[1]},
                               {"joint1.damping", 0.05},
                               {"joint2.damping", 0.02}});
  SimulationOptions simulation;
  simulation.duration = 0.4;
  simulation.rate = 25.0;
  simulation.noise = noise;
  simulation.seed = seed;
  simulation.step = 0.001;
  return Simulate(truth, RandomState(truth, 0.6, seed), simulation);
}

std::unique_ptr<ShootingProblem> Figure1(const Model& model, double noise,
                                         int seed,
                                         const RolloutOptions& rollout) {
  std::vector<Value> start{{"link1.length", 1.0}, {"link2.length", 1.0}};
  if (model.effects().size() > 0) {
    start.push_back({"joint1.damping", 0.0});
    start.push_back({"joint2.damping", 0.0});
  }
  EstimationOptions options;
  options.noise = noise;
  options.rollout = rollout;
  std::vector<FreeParameter> free = FreeFrom(model, start);
  for (int i = 0; i < 2; ++i) {  // as pendulum2.sysid.yaml has them
    free[i].lower = 0.05;
    free[i].upper = 10.0;
  }
  return std::make_unique<ShootingProblem>(
      model, free, std::vector<Run>{Figure1Run(noise, seed)}, options);
}

// Epoch from which the loss stays within a tenth of its last value.
int SettledAt(const std::vector<HistoryEntry>& history) {
  int settled = 0;
  for (const HistoryEntry& entry : history) {
    if (std::abs(entry.cost - history.back().cost) >
        kSettled * history.back().cost) {
      settled = entry.iteration + 1;
    }
  }
  return settled;
}

TEST(Figure1, AdamSettlesWithinEightyEpochsOnAModelWithoutTheDamping) {
  constexpr double kStep = 0.04;  // the paper's: one a sample, of first order
  for (int seed = 1; seed <= 10; ++seed) {
    const auto problem = Figure1(Shipped("pendulum2"), 1e-3, seed,
                                 {Integrator::kSemiImplicitEuler, kStep});
    AdamFitOptions options;
    options.from_rest = true;
    const Fit fit = FitAdam(*problem, options);
    EXPECT_TRUE(fit.converged) << fit.termination;
    EXPECT_GE(fit.history.front().cost, 4.0 * fit.history.back().cost);
    EXPECT_LE(SettledAt(fit.history), 80) << "seed " << seed;
    // What is missing from the model is paid by the parameters.
    const double off = std::abs(fit.parameters[1].value / kLengths[1] - 1.0);
    EXPECT_GT(off, 0.05) << "seed " << seed;
  }
}

TEST(Figure1, LevenbergMarquardtNeedsFifteenIterationsForTheSame) {
  for (int seed = 1; seed <= 10; ++seed) {
    const auto problem = Figure1(Shipped("pendulum2"), 1e-3, seed,
                                 {Integrator::kSemiImplicitEuler, 0.0});
    const Fit fit = FitLevenbergMarquardt(*problem);
    EXPECT_TRUE(fit.converged) << fit.termination;
    EXPECT_LE(fit.iterations, 15) << "seed " << seed;
  }
}

TEST(Figure1, WithDampingAndRungeKuttaBothFindTheLengthsWithinTwoPercent) {
  const Model model = Shipped("pendulum2", kDamping);
  constexpr int kSeeds = 5;
  int lm_converged = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const auto lm = Figure1(model, 1e-4, seed, {});
    const auto adam = Figure1(model, 1e-4, seed, {});
    AdamFitOptions options;
    options.from_rest = true;
    options.adam.epochs = 1500;
    const Fit fits[] = {FitLevenbergMarquardt(*lm), FitAdam(*adam, options)};
    lm_converged += fits[0].converged;
    EXPECT_TRUE(fits[1].converged) << fits[1].termination;
    for (const Fit& fit : fits) {
      for (int i = 0; i < 2; ++i) {
        EXPECT_NEAR(fit.parameters[i].value, kLengths[i], 0.02 * kLengths[i])
            << fit.solver << ", seed " << seed;
      }
    }
  }
  // It also estimates the first state, spins included: once in these five it is
  // still creeping along that valley after 400 iterations.
  EXPECT_GE(lm_converged, kSeeds - 1);
}

TEST(Figure2, TheMixtureFindsThreeLengthsFromRunsThatArriveOneByOne) {
  const std::vector<double> lengths{3.0, 5.0, 7.0};
  const Model truth = Shipped("pendulum3", {},
                              {{"link1.length", lengths[0]},
                               {"link2.length", lengths[1]},
                               {"link3.length", lengths[2]}});
  const Model model = Shipped("pendulum3");
  constexpr int kEpoch = 120, kSeeds = 10;
  int good = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    EstimationOptions given;
    given.noise = 1e-3;
    given.threads = 2;
    ShootingProblem problem(model,
                            FreeFrom(model, {{"link1.length", 4.0},
                                             {"link2.length", 4.0},
                                             {"link3.length", 4.0}}),
                            ReleasedRuns(truth, 10, 2.0, 1e-3, seed), given);
    MixtureOptions options;
    options.adam.schedule = Schedule::kConstant;
    options.from_rest = true;
    options.online = true;
    options.seed = seed;
    const MixtureFit fit = FitGaussianMixture(problem, options);
    const ParameterMixture& first = fit.epochs.front().kernels;
    const ParameterMixture& then = fit.epochs[kEpoch].kernels;
    bool ok = true;
    double worst = 0.0, narrowed = 1e9;
    for (int i = 0; i < 3; ++i) {
      const double off = std::abs(then.Mean()[i] / lengths[i] - 1.0);
      const double kernels = (then.stds.transpose() * then.weights)[i];
      const double kernels_first = (first.stds.transpose() * first.weights)[i];
      worst = std::max(worst, off);
      narrowed = std::min(
          {narrowed, first.Std()[i] / then.Std()[i], kernels_first / kernels});
      ok = ok && off < 0.02 && 5.0 * then.Std()[i] < first.Std()[i] &&
           5.0 * kernels < kernels_first;
    }
    good += ok;
    std::printf("seed %d: off by %.2f %%, narrowed %.1f-fold\n", seed,
                100.0 * worst, narrowed);
  }
  EXPECT_GE(good, 9) << "of " << kSeeds;
  RecordProperty("good", good);
  std::printf("%d of %d seeds\n", good, kSeeds);
}

}  // namespace
}  // namespace sysid
