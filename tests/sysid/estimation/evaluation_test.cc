#include "sysid/estimation/evaluation.h"

#include <gmock/gmock.h>

#include <cmath>

#include "sysid/estimation/holdout.h"
#include "sysid/estimation/segmentation.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

using Eigen::VectorXd;

sysid::Run Simulated(const Model& model, int seed, double noise = 1e-3,
                     double duration = 5.0) {
  SimulationOptions options;
  options.duration = duration;
  options.noise = noise;
  options.seed = seed;
  sysid::Run run = Simulate(model, RandomState(model, 0.5, seed), options);
  run.name = "run" + std::to_string(seed) + ".csv";
  return run;
}

Holdout Predict(const Model& model, const sysid::Run& held_out,
                const sysid::Run& train) {
  const EstimationOptions options;
  const auto fitted = MakeDataSet(model, {train}, options);
  return PredictHoldout(
      OpenHoldout(model, MakeDataSetLike(model, {held_out}, options, *fitted),
                  options, {.step = 0.01}, 0.5));
}

TEST(PredictHoldout, IsAtTheNoiseFloorForTheRightModel) {
  for (const char* name : {"pendulum2_planar", "pendulum2"}) {
    const Model model = Shipped(name);
    for (int seed = 1; seed <= 3; ++seed) {
      const Holdout holdout =
          Predict(model, Simulated(model, seed), Simulated(model, 10 + seed));
      EXPECT_NEAR(holdout.errors.total.normalized_rms, 1.0, 0.1)
          << name << ", seed " << seed;
      EXPECT_NEAR(holdout.errors.total.rms, 1e-3, 0.15e-3);
      ASSERT_EQ(holdout.open.size(), 1u);
      for (const auto& channel : holdout.open[0].channels) {
        EXPECT_LT(channel.rms, 0.01) << channel.name;
      }
    }
  }
}

// (8.1) and (8.2) by their definitions.
TEST(FitPercent, IsTheErrorAsAShareOfTheMotion) {
  const Model model = Shipped("pendulum2_planar");
  sysid::Run run = Simulated(model, 1);
  for (const sysid::Channel& channel : run.channels) {
    const auto y = channel.values.col(0).array();
    const double motion = std::sqrt((y - y.mean()).square().mean());
    const auto data = MakeDataSet(model, {run}, {});
    const int c = static_cast<int>(&channel - run.channels.data());
    EXPECT_NEAR(data->runs()[0]->motion[c], motion, 1e-9 * motion);
  }
  const Holdout holdout = Predict(model, run, run);
  double ratios = 0.0;
  for (size_t c = 0; c < run.channels.size(); ++c) {
    const ChannelError& channel = holdout.errors.channels[c];
    const double ratio = channel.rms / holdout.problem->runs()[0]->motion[c];
    EXPECT_NEAR(channel.fit_percent, 100.0 * (1.0 - ratio), 1e-9);
    ratios += ratio * ratio / run.channels.size();
  }
  EXPECT_NEAR(holdout.errors.total.fit_percent,
              100.0 * (1.0 - std::sqrt(ratios)), 1e-6);
}

TEST(FitPercent, OfATurnThatIsSeenTwiceIsTheSame) {
  // A joint that spins: its angle is unwrapped, whatever the file does.
  const Model model = Shipped("pendulum2_planar");
  sysid::Run run = Simulated(model, 1);
  sysid::Run wrapped = run;
  for (int k = 0; k < run.size(); ++k) {
    const double angle = 3.0 * run.t[k];
    run.channels[0].values(k, 0) = angle;
    wrapped.channels[0].values(k, 0) = std::remainder(angle, 2.0 * M_PI);
  }
  EXPECT_NEAR(MakeDataSet(model, {run}, {})->runs()[0]->motion[0],
              MakeDataSet(model, {wrapped}, {})->runs()[0]->motion[0], 1e-9);
}

TEST(FitPercent, IsNoneWhereNothingMoves) {
  const Model model = Shipped("pendulum2_planar");
  sysid::Run run = Simulated(model, 1);
  for (sysid::Channel& channel : run.channels) channel.values.setZero();
  const Holdout holdout = Predict(model, run, Simulated(model, 2));
  for (const ChannelError& channel : holdout.errors.channels) {
    EXPECT_TRUE(std::isnan(channel.fit_percent));
  }
  EXPECT_TRUE(std::isnan(holdout.errors.total.fit_percent));
}

TEST(PredictHoldout, IsFarAboveItForAWrongLength) {
  const Model truth = Shipped("pendulum2_planar", {}, {{"link1.length", 0.4}});
  const Model model = Shipped("pendulum2_planar");
  const Holdout holdout =
      Predict(model, Simulated(truth, 1), Simulated(truth, 2));
  EXPECT_GT(holdout.errors.total.normalized_rms, 2.0);
}

TEST(PredictHoldout, UsesTheNoiseOfTheFittedRuns) {
  const Model model = Shipped("pendulum2_planar");
  const Holdout holdout =
      Predict(model, Simulated(model, 1, 3e-3), Simulated(model, 2, 1e-3));
  EXPECT_NEAR(holdout.errors.total.normalized_rms, 3.0, 0.3);
}

// The errors of states that are exact: noise and nothing else.
struct Exact {
  explicit Exact(const std::string& name, double noise = 1e-3)
      : model(Shipped(name)) {
    EstimationOptions options;
    options.noise = noise;
    options.rollout.step = 0.01;
    problem = std::make_unique<ShootingProblem>(
        model, std::vector<FreeParameter>(),
        std::vector<sysid::Run>{Simulated(model, 5, noise, 10.0)}, options);
    Solution::Nodes nodes;
    nodes.samples = {0, 1000};
    nodes.states = RandomState(model, 0.5, 5).transpose();
    point.theta.resize(0);
    point.runs.push_back(nodes);
  }
  Model model;
  std::unique_ptr<ShootingProblem> problem;
  Solution point;
};

TEST(EvaluateErrors, CountsIndependentNumbers) {
  // A heading in space has three components and two degrees of freedom.
  for (const char* name : {"pendulum2_planar", "pendulum2", "cartpole"}) {
    const Exact at(name);
    const RunErrors errors = EvaluateErrors(*at.problem, at.point, 0.0);
    EXPECT_NEAR(errors.total.normalized_rms, 1.0, 0.05) << name;
    EXPECT_NEAR(errors.total.rms, 1e-3, 0.05e-3) << name;
    ASSERT_EQ(errors.channels.size(), 2u);
    for (const ChannelError& channel : errors.channels) {
      EXPECT_NEAR(channel.normalized_rms, 1.0, 0.1) << channel.name;
      EXPECT_EQ(channel.noise, 1e-3);
    }
    ASSERT_EQ(errors.segments.size(), 1u);
    EXPECT_EQ(errors.segments[0].trajectory, "run5.csv");
    EXPECT_EQ(errors.segments[0].t_start, 0.0);
    EXPECT_DOUBLE_EQ(errors.segments[0].t_end, 10.0);
  }
}

TEST(EvaluateErrors, CorrectForWhatWasFitted) {
  const Exact at("pendulum2_planar");
  const double plain =
      EvaluateErrors(*at.problem, at.point, 0.0).total.normalized_rms;
  const double dof = 2.0 * 1001;
  EXPECT_NEAR(
      EvaluateErrors(*at.problem, at.point, 0.5 * dof).total.normalized_rms,
      std::sqrt(2.0) * plain, 1e-9);
}

TEST(EvaluateOpen, AreInTheMeasurementsOwnUnit) {
  const Exact at("cartpole");
  const std::vector<OpenError> open = EvaluateOpen(*at.problem, at.point);
  ASSERT_EQ(open.size(), 1u);
  EXPECT_EQ(open[0].trajectory, "run5.csv");
  EXPECT_DOUBLE_EQ(open[0].duration_s, 10.0);
  ASSERT_EQ(open[0].channels.size(), 2u);
  EXPECT_EQ(open[0].channels[0].unit, "m");
  EXPECT_EQ(open[0].channels[1].unit, "rad");
  for (const auto& channel : open[0].channels) {
    EXPECT_NEAR(channel.rms, 1e-3, 0.1e-3) << channel.name;
  }
}

TEST(EvaluateOpen, TellTheAngleOfALargeError) {
  Exact at("pendulum2_planar", 1e-9);
  // The first joint measured 2 rad off, once around the circle.
  auto run = at.problem->runs()[0]->run;
  run.channels[0].values.array() += 2.0 + 2.0 * M_PI;
  EstimationOptions options = at.problem->options();
  const ShootingProblem off(at.model, {}, {run}, options);
  const std::vector<OpenError> open = EvaluateOpen(off, at.point);
  EXPECT_NEAR(open[0].channels[0].rms, 2.0, 1e-3);
  EXPECT_NEAR(open[0].channels[1].rms, 0.0, 1e-3);
}

TEST(EvaluateHorizon, GrowsFromTheNoiseFloor) {
  const Model model = Shipped("pendulum2_planar");
  EstimationOptions options;
  options.rollout.step = 0.01;
  const ShootingProblem problem(model, {}, {Simulated(model, 3)}, options);
  Solution start;  // no parameters; the states are estimated
  start.rollout = options.rollout;
  const std::vector<HorizonError> horizon = EvaluateHorizon(problem, start);
  ASSERT_GE(horizon.size(), 6u);
  EXPECT_EQ(horizon.front().horizon_s, 0.05);
  // Within the window that the state was estimated from: the noise.
  EXPECT_NEAR(horizon.front().rms, 1e-3, 0.3e-3);
  // Beyond it the state's error grows.
  EXPECT_GT(horizon.back().rms, horizon.front().rms);
  EXPECT_LT(horizon.back().rms, 0.5);
}

TEST(PredictChannels, MeasureTheStates) {
  for (const char* name : {"cartpole", "pendulum2"}) {
    const Exact at(name, 1e-9);
    RowMatrixXd states;
    ASSERT_TRUE(SampleStates(*at.problem, at.point, 0, &states));
    const std::vector<RowMatrixXd> predicted =
        PredictChannels(*at.problem, at.point, 0, states);
    const auto& channels = at.problem->runs()[0]->run.channels;
    ASSERT_EQ(predicted.size(), channels.size());
    for (size_t c = 0; c < channels.size(); ++c) {
      ASSERT_EQ(predicted[c].cols(), channels[c].values.cols());
      for (int k = 0; k < predicted[c].rows(); ++k) {
        const auto p = predicted[c].row(k), m = channels[c].values.row(k);
        const double away = p.size() == 4
                                ? std::min((p - m).norm(), (p + m).norm())
                                : (p - m).norm();
        ASSERT_LT(away, 1e-4) << name << " " << k;
      }
    }
  }
}

TEST(ObservedStateDof, LeavesOutTheSpinThatHeadingsDoNotShow) {
  EXPECT_EQ(ObservedStateDof(*Exact("pendulum2_planar").problem), 4.0);
  EXPECT_EQ(ObservedStateDof(*Exact("pendulum2").problem), 8.0);
}

}  // namespace
}  // namespace sysid
