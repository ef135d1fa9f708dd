// What the project promises of the shipped pendulums, on simulated runs.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "models/find_model.h"
#include "models/math/rotation.h"
#include "models/urdf/load_urdf.h"
#include "sysid/estimation/fit.h"
#include "sysid/simulation/simulate.h"

namespace sysid {
namespace {

Model Shipped(const std::string& name) {
  return MakeModel(LoadUrdf(FindModel(name)), Catalogue());
}

std::vector<std::string> Lengths(int links) {
  std::vector<std::string> names;
  for (int i = 1; i <= links; ++i) {
    names.push_back("link" + std::to_string(i) + ".length");
  }
  return names;
}

Model WithLengths(const std::string& name, const std::vector<double>& lengths) {
  Model model = Shipped(name);
  SetParameters(FindParameters(model, Lengths(lengths.size()), "test"), lengths,
                &model);
  return model;
}

// Every spherical joint tilted by `tilt` (rad) about a horizontal axis that the
// seed draws; at rest.
Eigen::VectorXd TiltedState(const Model& model, double tilt, int seed) {
  Eigen::VectorXd x = RandomState(model, 1.0, seed);
  for (const Body& body : model.bodies()) {
    const Eigen::Vector3d axis = x.segment<3>(body.q_index).normalized();
    x.segment<4>(body.q_index) =
        Exp<double>(Eigen::Vector3d(tilt * axis)).coeffs();
  }
  return x;
}

std::vector<FreeParameter> FreeLengths(const Model& model,
                                       const std::vector<double>& start) {
  std::vector<FreeParameter> free;
  for (const Parameter& parameter :
       FindParameters(model, Lengths(start.size()), "test")) {
    FreeParameter f;
    f.parameter = parameter;
    f.initial = start[free.size()];
    f.lower = 0.05;
    f.upper = 10.0;
    free.push_back(f);
  }
  return free;
}

// SYSID_SEEDS=100 for the figures of the documentation.
int Seeds() {
  const char* given = std::getenv("SYSID_SEEDS");
  return given != nullptr ? std::atoi(given) : 5;
}

struct Case {
  double tilt;  // rad; at 1.0 the swing is chaotic
  double off;   // start over truth
};

class Pendulum3 : public testing::TestWithParam<Case> {};

TEST_P(Pendulum3, LengthsStartedThirtyPercentOffEndWithinATenthOfAPercent) {
  const std::vector<double> truth{0.3, 0.4, 0.35};
  const Model model = Shipped("pendulum3");
  int held = 0, total = 0;
  for (int seed = 1; seed <= Seeds(); ++seed) {
    const Model true_model = WithLengths("pendulum3", truth);
    SimulationOptions simulation;
    simulation.noise = 1e-3;
    simulation.seed = seed;
    const sysid::Run run = Simulate(
        true_model, TiltedState(true_model, GetParam().tilt, seed), simulation);
    std::vector<double> start;
    for (const double length : truth) start.push_back(GetParam().off * length);
    EstimationOptions options;
    options.threads = 2;
    ShootingProblem problem(model, FreeLengths(model, start), {run}, options);
    const Fit fit = FitLevenbergMarquardt(problem);
    ASSERT_TRUE(fit.converged) << "seed " << seed << ": " << fit.termination;
    for (size_t i = 0; i < truth.size(); ++i) {
      const ParameterEstimate& p = fit.parameters[i];
      EXPECT_NEAR(p.value, truth[i], 1e-3 * truth[i]) << "seed " << seed;
      held += p.ci95[0] <= truth[i] && truth[i] <= p.ci95[1];
      ++total;
    }
    EXPECT_NEAR(fit.train.total.normalized_rms, 1.0, 0.1);
  }
  // Intervals at 95 %, less four standard deviations of their count.
  EXPECT_GE(held, 0.95 * total - 4.0 * std::sqrt(0.95 * 0.05 * total))
      << "of " << total;
  RecordProperty("held", held);
  std::printf("%d of %d intervals hold the truth\n", held, total);
}

INSTANTIATE_TEST_SUITE_P(Tilts, Pendulum3,
                         testing::Values(Case{0.3, 1.3}, Case{0.3, 0.7},
                                         Case{0.6, 1.3}, Case{0.6, 0.7},
                                         Case{1.0, 1.3}, Case{1.0, 0.7}));

// The experiment of figure 1 of Heiden et al.: 10 steps at 25 Hz.
Fit FitFigure1(const Model& truth, double noise, int seed, const Model& model) {
  SimulationOptions simulation;
  simulation.noise = noise;
  simulation.seed = seed;
  simulation.duration = 0.4;
  simulation.rate = 25.0;
  const Run run = Simulate(truth, RandomState(truth, 0.6, seed), simulation);
  EstimationOptions options;
  options.noise = noise;
  ShootingProblem problem(model, FreeLengths(model, {1.0, 1.0}), {run},
                          options);
  return FitLevenbergMarquardt(problem);
}

TEST(Figure1, IsSolvedInFifteenIterationsWithoutNoise) {
  const Model truth = WithLengths("pendulum2", {0.810, 0.304});
  for (int seed = 1; seed <= 20; ++seed) {
    const Fit fit = FitFigure1(truth, 0.0, seed, Shipped("pendulum2"));
    EXPECT_TRUE(fit.converged) << fit.termination;
    EXPECT_LE(fit.iterations, 15) << "seed " << seed;
    EXPECT_NEAR(fit.parameters[0].value, 0.810, 0.810e-3);
    EXPECT_NEAR(fit.parameters[1].value, 0.304, 0.304e-3);
  }
}

TEST(Figure1, HoldsTheTruthInItsIntervalsWithNoise) {
  const Model truth = WithLengths("pendulum2", {0.810, 0.304});
  int held = 0;
  for (int seed = 1; seed <= 20; ++seed) {
    const Fit fit = FitFigure1(truth, 1e-3, seed, Shipped("pendulum2"));
    EXPECT_TRUE(fit.converged) << fit.termination;
    EXPECT_LE(fit.iterations, 15) << "seed " << seed;
    const double lengths[2] = {0.810, 0.304};
    for (int i = 0; i < 2; ++i) {
      held += fit.parameters[i].ci95[0] <= lengths[i] &&
              lengths[i] <= fit.parameters[i].ci95[1];
    }
  }
  // Forty intervals at 95 %: fewer than 33 has a chance of 1e-3.
  EXPECT_GE(held, 33);
}

}  // namespace
}  // namespace sysid
