#include "sysid/estimation/fit.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "models/dynamics.h"
#include "tests/support/fit_setup.h"
#include "tests/sysid/estimation/simulated.h"

namespace sysid {
namespace {

using Eigen::VectorXd;
using ::testing::AnyOf;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// The truth within four standard errors, and these small.
void ExpectRecovers(const Fit& fit, const std::vector<Value>& truth,
                    double relative_error) {
  EXPECT_TRUE(fit.converged) << fit.termination;
  EXPECT_THAT(fit.not_identifiable, IsEmpty());
  for (const Value& value : truth) {
    const ParameterEstimate& estimate = EstimateOf(fit, value.name);
    EXPECT_EQ(estimate.name, value.name);
    EXPECT_TRUE(estimate.identifiable) << value.name;
    EXPECT_LT(std::abs(Deviation(fit, value)), 4.0)
        << value.name << " = " << estimate.value << " +- "
        << estimate.std_error;
    EXPECT_LT(estimate.std_error, relative_error * std::abs(value.value))
        << value.name;
  }
}

// --- Planted parameters -----------------------------------------------------

TEST(Fit, FindsLengthsToTheIntegrationErrorWithoutNoise) {
  const std::vector<Value> truth = {{"link1.length", 0.4},
                                    {"link2.length", 0.3}};
  const Model planted = Shipped("pendulum2_planar", {}, truth);
  const Model start = Shipped("pendulum2_planar");
  EstimationOptions options;
  options.noise = 1e-4;
  const Fit fit = FitRuns(
      start, FreeFrom(start, {{"link1.length", 0.5}, {"link2.length", 0.5}}),
      {Simulated(planted, 0.6, 1, 5.0, 0.0)}, options);
  EXPECT_TRUE(fit.converged);
  for (const Value& value : truth) {
    EXPECT_NEAR(EstimateOf(fit, value.name).value, value.value,
                1e-4 * value.value);
  }
}

TEST(Fit, FindsTheLengthsOfSphericalPendulums) {
  const std::vector<Value> truth = {{"link1.length", 0.4},
                                    {"link2.length", 0.3}};
  const Model planted = Shipped("pendulum2", {}, truth);
  const Model start = Shipped("pendulum2");
  for (const auto orientation :
       {OrientationResidual::kHeading, OrientationResidual::kRotation}) {
    EstimationOptions options;
    options.orientation = orientation;
    const Fit fit = FitRuns(
        start, FreeFrom(start, {{"link1.length", 0.5}, {"link2.length", 0.4}}),
        {Simulated(planted, 0.5, 2)}, options);
    ExpectRecovers(fit, truth, 0.002);
    EXPECT_NEAR(fit.train.total.normalized_rms, 1.0, 0.1);
  }
}

TEST(Fit, FindsFrictionDampingBiasAndOffsetOfACartpole) {
  const std::vector<std::string> effects = {
      "coulomb_friction@slider", "viscous_damping@hinge", "effort_bias@slider",
      "sensor_offset@hinge"};
  const std::vector<Value> truth = {{"slider.friction", 0.4},
                                    {"hinge.damping", 0.01},
                                    {"slider.effort_bias", 0.3},
                                    {"hinge.sensor_offset", 0.05}};
  const Model planted = Shipped("cartpole", effects, truth);
  const Model start = Shipped("cartpole", effects);
  const Fit fit =
      FitRuns(start,
              FreeFrom(start, {{"slider.friction", 0.0},
                               {"hinge.damping", 0.0},
                               {"slider.effort_bias", 0.0},
                               {"hinge.sensor_offset", 0.0}}),
              {Simulated(planted, 0.5, 3, 10.0, 1e-3, Excitation::kMultisine)});
  ExpectRecovers(fit, truth, 0.05);
  EXPECT_NEAR(fit.train.total.normalized_rms, 1.0, 0.1);
}

// A body on a spherical joint of which everything about its rotation is free:
// the six entries of its inertia, kept a possible body by (4.1). In a passive
// swing its size does not matter: masses scale, and the inertias with them.
Fit FitTumblingBody(double size) {
  Mechanism mechanism;
  mechanism.AddRoot("base");
  Joint joint;
  joint.name = "ball";
  joint.type = JointType::kSpherical;
  joint.parent_link = 0;
  Inertial<double> body;
  body.mass = size;
  body.com = Eigen::Vector3d(0.05, -0.1, -0.2);
  body.inertia << 0.03, 0.004, -0.002, 0.004, 0.04, 0.003, -0.002, 0.003, 0.02;
  body.inertia *= size;
  mechanism.AddJoint(joint, "body", Eigen::Vector3d::Zero(), body);
  const Model planted(mechanism);
  Inertial<double> guess = body;
  guess.inertia = 0.03 * size * Eigen::Matrix3d::Identity();
  mechanism.nominal.links[1] = guess;
  const Model start(mechanism);
  VectorXd x0(7);
  x0 << Exp<double>(Eigen::Vector3d(0.8, -0.5, 0.3)).coeffs(), 2.0, -1.0, 4.0;
  SimulationOptions simulation;
  simulation.duration = 5.0;
  simulation.noise = 1e-3;
  EstimationOptions options;
  options.orientation = OrientationResidual::kRotation;
  return FitRuns(start,
                 FreeFrom(start, {{"body.ixx", 0.03 * size},
                                  {"body.iyy", 0.03 * size},
                                  {"body.izz", 0.03 * size},
                                  {"body.ixy", 0.0},
                                  {"body.ixz", 0.0},
                                  {"body.iyz", 0.0}}),
                 {Simulate(planted, x0, simulation)}, options);
}

TEST(Fit, FindsTheSixInertiasOfATumblingBody) {
  for (const double size : {1.0, 1e-5}) {
    const Fit fit = FitTumblingBody(size);
    ExpectRecovers(fit,
                   {{"body.ixx", 0.03 * size},
                    {"body.iyy", 0.04 * size},
                    {"body.izz", 0.02 * size},
                    {"body.ixy", 0.004 * size},
                    {"body.ixz", -0.002 * size},
                    {"body.iyz", 0.003 * size}},
                   0.2);
    // A small moment is not one at its bound of zero.
    for (const ParameterEstimate& estimate : fit.parameters) {
      EXPECT_FALSE(estimate.at_bound) << estimate.name << ", size " << size;
    }
  }
}

TEST(Fit, SkipsMissingSamples) {
  const std::vector<Value> truth = {{"link1.length", 0.4},
                                    {"link2.length", 0.3}};
  sysid::Run run = Simulated(Shipped("pendulum2_planar", {}, truth), 0.6, 4);
  std::mt19937_64 random(1);
  int missing = 0;
  for (Channel& channel : run.channels) {
    for (double& value : channel.values.reshaped()) {
      if (random() % 10 < 3) value = kNaN, ++missing;
    }
  }
  ASSERT_GT(missing, 250);
  // And a whole second of one joint.
  run.channels[1].values.middleRows(200, 100).setConstant(kNaN);
  const Model start = Shipped("pendulum2_planar");
  const Fit fit = FitRuns(
      start, FreeFrom(start, {{"link1.length", 0.5}, {"link2.length", 0.4}}),
      {run});
  ExpectRecovers(fit, truth, 0.002);
  EXPECT_NEAR(fit.train.total.normalized_rms, 1.0, 0.1);
}

TEST(Fit, OfTwoRunsJointlyKnowsMoreThanOfEither) {
  const std::vector<Value> truth = {{"link1.length", 0.4},
                                    {"link2.length", 0.3}};
  const Model planted = Shipped("pendulum2_planar", {}, truth);
  const Model start = Shipped("pendulum2_planar");
  const auto free =
      FreeFrom(start, {{"link1.length", 0.5}, {"link2.length", 0.4}});
  const sysid::Run a = Simulated(planted, 0.6, 5),
                   b = Simulated(planted, 0.6, 6);
  const Fit both = FitRuns(start, free, {a, b});
  ExpectRecovers(both, truth, 0.001);
  EXPECT_EQ(both.samples, a.size() + b.size());
  ASSERT_EQ(both.open.size(), 2u);
  EXPECT_EQ(both.open[0].trajectory, "run5.csv");
  EXPECT_EQ(both.open[1].trajectory, "run6.csv");
  const Fit first = FitRuns(start, free, {a}),
            second = FitRuns(start, free, {b});
  for (const Value& value : truth) {
    // Information adds: 1/s^2 = 1/s1^2 + 1/s2^2, but for the scatter of the
    // noise estimates.
    const double s1 = EstimateOf(first, value.name).std_error;
    const double s2 = EstimateOf(second, value.name).std_error;
    const double joint = 1.0 / std::sqrt(1 / (s1 * s1) + 1 / (s2 * s2));
    EXPECT_NEAR(EstimateOf(both, value.name).std_error, joint, 0.2 * joint);
  }
}

TEST(Fit, BearsOutliersWithARobustLoss) {
  const std::vector<Value> truth = {{"link1.length", 0.4},
                                    {"link2.length", 0.3}};
  sysid::Run run = Simulated(Shipped("pendulum2_planar", {}, truth), 0.6, 7);
  std::mt19937_64 random(2);
  for (Channel& channel : run.channels) {
    for (double& value : channel.values.reshaped()) {
      if (random() % 100 < 3) value += 0.3;
    }
  }
  const Model start = Shipped("pendulum2_planar");
  const auto free =
      FreeFrom(start, {{"link1.length", 0.5}, {"link2.length", 0.4}});
  EstimationOptions options;
  options.noise = 1e-3;
  const auto worst = [&](RobustLoss loss) {
    options.loss = loss;
    const Fit fit = FitRuns(start, free, {run}, options);
    EXPECT_TRUE(fit.converged) << fit.termination;
    double error = 0.0;
    for (const Value& value : truth) {
      error = std::max(
          error,
          std::abs(EstimateOf(fit, value.name).value / value.value - 1.0));
    }
    return error;
  };
  const double plain = worst(RobustLoss::kNone);
  EXPECT_LT(worst(RobustLoss::kHuber), 0.3 * plain);
  EXPECT_LT(worst(RobustLoss::kCauchy), 0.1 * plain);
  EXPECT_LT(worst(RobustLoss::kCauchy), 5e-4);
}

// --- What a fit says of itself ----------------------------------------------

TEST(Fit, DescribesItself) {
  const Model start = Shipped("pendulum2_planar");
  const sysid::Run run = Simulated(
      Shipped("pendulum2_planar", {}, {{"link1.length", 0.4}}), 0.6, 8);
  const Fit fit =
      FitRuns(start, FreeFrom(start, {{"link1.length", 0.5}}), {run});
  EXPECT_EQ(fit.solver, "lm");
  EXPECT_TRUE(fit.converged);
  EXPECT_FALSE(fit.termination.empty());
  EXPECT_EQ(fit.samples, run.size());
  EXPECT_NEAR(fit.noise, 1e-3, 0.1e-3);
  EXPECT_NEAR(fit.step_s, 0.01, 1e-9);
  EXPECT_GT(fit.segment_s, 0.05);
  EXPECT_GT(fit.iterations, 0);
  EXPECT_GT(fit.wall_time_s, 0.0);
  ASSERT_FALSE(fit.history.empty());
  EXPECT_EQ(fit.history.front().iteration, 0);
  EXPECT_LT(fit.history.back().cost, fit.history.front().cost);
  for (size_t i = 1; i < fit.history.size(); ++i) {
    EXPECT_GE(fit.history[i].time_s, fit.history[i - 1].time_s);
    EXPECT_GT(fit.history[i].iteration, fit.history[i - 1].iteration);
  }
  ASSERT_EQ(fit.parameters.size(), 1u);
  const ParameterEstimate& length = fit.parameters[0];
  EXPECT_EQ(length.initial, 0.5);
  EXPECT_EQ(length.unit, "m");
  EXPECT_NEAR(length.ci95[0], length.value - 1.96 * length.std_error, 1e-9);
  EXPECT_NEAR(length.ci95[1], length.value + 1.96 * length.std_error, 1e-9);
  EXPECT_NEAR(fit.covariance(0, 0), length.std_error * length.std_error,
              1e-12 * fit.covariance(0, 0));
  // The model is the fitted one.
  const int link = fit.model.mechanism().FindLink("link1");
  EXPECT_NEAR(LinkLength(fit.model.mechanism(), fit.model.nominal(), link),
              length.value, 1e-12);
  ASSERT_EQ(fit.train.channels.size(), 2u);
  EXPECT_EQ(fit.train.channels[0].name, "joint1");
  EXPECT_EQ(fit.train.channels[0].unit, "rad");
}

TEST(Fit, ReportsItsProgress) {
  const Model start = Shipped("pendulum2_planar");
  const sysid::Run run = Simulated(start, 0.6, 8, 2.0);
  std::vector<Progress> seen;
  EstimationOptions options;
  options.progress = [&](const Progress& progress) {
    seen.push_back(progress);
  };
  FitRuns(start, FreeFrom(start, {{"link1.length", 0.55}}), {run}, options);
  ASSERT_FALSE(seen.empty());
  EXPECT_FALSE(seen.back().doing.empty());
  for (const Progress& progress : seen) {
    EXPECT_LE(progress.iteration, progress.of) << progress.doing;
  }
}

// At the minimum of a long run rounding decides whether a step is taken. One
// that is refused there must not be followed by others of ever smaller radius.
TEST(Fit, EndsWhereNothingIsLeftToGain) {
  const Model model = Shipped("pendulum2_planar");
  for (const int seed : {1, 2, 3, 4}) {
    const Fit fit = FitRuns(
        model,
        FreeFrom(model, {{"link1.length", 0.45}, {"link2.length", 0.55}}),
        {Simulated(model, 0.5, seed, 60.0)}, EstimationOptions());
    EXPECT_TRUE(fit.converged);
    const double last = fit.history.back().cost;
    const auto still = [&](const HistoryEntry& entry) {
      return std::abs(entry.cost - last) < 1e-12 * last;
    };
    EXPECT_LE(std::count_if(fit.history.begin(), fit.history.end(), still), 2)
        << "seed " << seed;
  }
}

// The lengths of three links, from far off: short segments take a few steps,
// and every later stage one to four. Before the states followed a step
// (JoinedStates), tight joints let a fit crawl, for 61 iterations.
TEST(Fit, TakesNoIterationsThatGainNothing) {
  const Model model = Shipped("pendulum3");
  const Model planted = Shipped(
      "pendulum3", {},
      {{"link1.length", 0.3}, {"link2.length", 0.4}, {"link3.length", 0.35}});
  for (const int seed : {1, 2, 3}) {
    const Fit fit =
        FitRuns(model,
                FreeFrom(model, {{"link1.length", 0.5},
                                 {"link2.length", 0.5},
                                 {"link3.length", 0.5}}),
                {Simulated(planted, 0.6, seed, 10.0)}, EstimationOptions());
    EXPECT_TRUE(fit.converged) << fit.termination;
    EXPECT_LE(fit.iterations, 25) << "seed " << seed;
    EXPECT_LE(fit.evaluations, 60) << "seed " << seed;
  }
}

TEST(Fit, StopsAfterTheIterationsItMayUse) {
  const Model start = Shipped("pendulum2_planar");
  const sysid::Run run = Simulated(
      Shipped("pendulum2_planar", {}, {{"link1.length", 0.3}}), 1.0, 9);
  EstimationOptions options;
  options.max_iterations = 1;
  const Fit fit =
      FitRuns(start, FreeFrom(start, {{"link1.length", 2.0}}), {run}, options);
  EXPECT_FALSE(fit.converged);
  EXPECT_THAT(fit.termination,
              testing::HasSubstr("still moving after the 1 iterations"));
}

// A constant force as a spring whose reference runs away.
TEST(Fit, StopsWhereTheIterationsLeftWouldGainTooLittle) {
  const sysid::Run run =
      Simulated(Shipped("pendulum2_planar", {"effort_bias@joint1"},
                        {{"joint1.effort_bias", 0.2}}),
                1.0, 9);
  const Model start =
      Shipped("pendulum2_planar", {"spring@joint1"},
              {{"joint1.stiffness", 0.1}, {"joint1.spring_reference", 1.0}});
  EstimationOptions options;
  options.segment = 1.0;
  options.max_iterations = 60;
  const auto fit = [&] {
    return FitIndependentSegments(ShootingProblem(
        start,
        FreeFrom(start,
                 {{"joint1.stiffness", 0.1}, {"joint1.spring_reference", 1.0}}),
        {run}, options));
  };
  const Fit whole = fit();
  options.least_gain = 0.1;
  const Fit early = fit();
  EXPECT_LT(early.iterations, whole.iterations);
  EXPECT_LT(early.train.squares, 1.2 * whole.train.squares);
}

// The same as one trajectory: what is wanted of it, it has, or it has not.
TEST(Fit, StopsWhereItWouldNotReachTheWantedError) {
  const sysid::Run run =
      Simulated(Shipped("pendulum2_planar", {"effort_bias@joint1"},
                        {{"joint1.effort_bias", 0.2}}),
                2.0, 9);
  const Model start =
      Shipped("pendulum2_planar", {"spring@joint1"},
              {{"joint1.stiffness", 0.1}, {"joint1.spring_reference", 1.0}});
  EstimationOptions options;
  options.max_iterations = 100;
  const auto fit = [&] {
    return FitLevenbergMarquardt(ShootingProblem(
        start,
        FreeFrom(start,
                 {{"joint1.stiffness", 0.1}, {"joint1.spring_reference", 1.0}}),
        {run}, options));
  };
  const Fit whole = fit();
  const double error = whole.train.total.normalized_rms;
  options.wanted_error = 0.1 * error;
  const Fit early = fit();
  EXPECT_LT(early.iterations, whole.iterations);
  EXPECT_GT(early.train.total.normalized_rms, options.wanted_error);
  options.wanted_error = 1.1 * error;
  EXPECT_NEAR(fit().train.total.normalized_rms, error, 0.01 * error);
}

TEST(Fit, CountsNoIterationOfAMotionThatNothingFollows) {
  const Model model = Shipped("pendulum2_planar");
  sysid::Run run = Simulated(model, 0.6, 1, 2.0, 1e-3, Excitation::kMultisine);
  run.effort *= 1e7;
  const Fit fit = FitRuns(model, FreeFrom(model, {{"link1.length", 0.5}}),
                          {run}, EstimationOptions());
  EXPECT_FALSE(fit.converged);
  EXPECT_EQ(fit.iterations, 0);
}

// --- Bounds and priors ------------------------------------------------------

TEST(Fit, FlagsAParameterAtItsBound) {
  const Model start = Shipped("pendulum2_planar");
  const sysid::Run run = Simulated(
      Shipped("pendulum2_planar", {}, {{"link1.length", 0.4}}), 0.4, 10);
  auto free = FreeFrom(start, {{"link1.length", 0.5}, {"link2.length", 0.5}});
  free[0].lower = 0.45;
  const Fit fit = FitRuns(start, free, {run});
  const ParameterEstimate& held = EstimateOf(fit, "link1.length");
  EXPECT_EQ(held.value, 0.45);
  EXPECT_EQ(held.lower, 0.45);
  EXPECT_TRUE(held.at_bound);
  // Held by its bound, not known from the data.
  EXPECT_TRUE(std::isnan(held.std_error));
  EXPECT_TRUE(std::isnan(held.ci95[0]));
  const ParameterEstimate& other = EstimateOf(fit, "link2.length");
  EXPECT_FALSE(other.at_bound);
  EXPECT_TRUE(std::isfinite(other.std_error));
}

TEST(Fit, KeepsAFrictionThatIsNotThereAtZero) {
  const std::vector<std::string> effects = {"coulomb_friction@joint1"};
  const Model start = Shipped("pendulum2_planar", effects);
  const Fit fit = FitRuns(
      start,
      FreeFrom(start, {{"link1.length", 0.55}, {"joint1.friction", 0.1}}),
      {Simulated(Shipped("pendulum2_planar"), 0.6, 11)});
  EXPECT_TRUE(fit.converged) << fit.termination;
  EXPECT_GE(EstimateOf(fit, "joint1.friction").value, 0.0);
  EXPECT_LT(EstimateOf(fit, "joint1.friction").value, 1e-3);
  EXPECT_NEAR(EstimateOf(fit, "link1.length").value, 0.5, 1e-3);
}

TEST(Fit, ListensToAPrior) {
  const Model start = Shipped("pendulum2_planar");
  const sysid::Run run = Simulated(start, 0.6, 12, 2.0);
  auto free = FreeFrom(start, {{"link1.length", 0.5}});
  const Fit without = FitRuns(start, free, {run});
  const double known = without.parameters[0].std_error;
  // A belief as firm as the data, six standard errors away: half way between.
  const double mean = without.parameters[0].value + 6.0 * known;
  free[0].prior = FreeParameter::Prior{mean, known};
  const Fit with = FitRuns(start, free, {run});
  EXPECT_NEAR(with.parameters[0].value,
              0.5 * (mean + without.parameters[0].value), 0.5 * known);
  EXPECT_NEAR(with.parameters[0].std_error, known / std::sqrt(2.0),
              0.1 * known);
}

}  // namespace
}  // namespace sysid
