#include "residuals/segment.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "models/state.h"
#include "models/stepper.h"
#include "tests/support/all_joints.h"
#include "tests/support/measured_run.h"
#include "tests/support/ridders.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

VectorXd RandomX(const Model& model, Random* random) {
  const RandomState at(model.mechanism(), random);
  VectorXd x(model.state_size());
  x << at.q, at.qd;
  return x;
}

Model ModelWithEffects() {
  Model model{AllJoints()};
  Random random(1);
  AddEveryEffect(Catalogue(), &random, &model);
  return model;
}

// Every link's and joint's parameters and the effects', none of which fights
// another; the first `count`.
std::vector<Parameter> SomeParameters(const Model& model, int count) {
  std::vector<Parameter> chosen;
  for (const Parameter& parameter : AllParameters(model)) {
    if (parameter.kind == ParameterKind::kEffect) chosen.push_back(parameter);
  }
  for (const Parameter& parameter : AllParameters(model)) {
    if (parameter.kind != ParameterKind::kEffect) chosen.push_back(parameter);
  }
  EXPECT_GE(static_cast<int>(chosen.size()), count);
  chosen.resize(count);
  return chosen;
}

VectorXd ThetaOf(const ParameterMap& map) {
  VectorXd values(map.size()), theta;
  for (int i = 0; i < map.size(); ++i) values[i] = map.parameters()[i].nominal;
  EXPECT_TRUE(map.ThetaOf(values, &theta));
  return theta;
}

// 12 columns of the state and so many of theta: one pass of 16 or 24 columns,
// several of them, with and without padding.
class LinearizeTest : public testing::TestWithParam<int> {};

TEST_P(LinearizeTest, EqualsDifferences) {
  const Model model = ModelWithEffects();
  const ParameterMap map(model, SomeParameters(model, GetParam()));
  Random random(2);
  VectorXd x0 = RandomX(model, &random);
  // Fast enough that no joint stops: what that does to the derivatives is of
  // the flow, and of the steps to their own error (dry_friction_test.cc).
  for (const Body& body : model.bodies()) {
    if (body.type == JointType::kSpherical) continue;
    double& rate = x0[model.layout().qd(body)];
    rate += std::copysign(2.0, rate);
  }
  const sysid::Run run = MeasureEverything(model, x0, 6, 0.02, 0.1, &random);
  const Measurements measurements =
      MeasurementsOf(model.mechanism(), run, OrientationResidual::kRotation);
  const SegmentRollout rollout(&model, &map, &measurements, 0, 5,
                               {Integrator::kRungeKutta4, 0.01});
  const int tangent = model.tangent_size();
  const int columns = tangent + map.size();
  const VectorXd theta = ThetaOf(map);
  VectorXd errors(rollout.num_residuals()), x_end(model.state_size());
  RowMatrixXd J, J_end;
  ASSERT_TRUE(rollout.Linearize(x0.data(), theta.data(), true, errors.data(),
                                x_end.data(), &J, &J_end));
  ASSERT_EQ(J.rows(), rollout.num_residuals());
  ASSERT_EQ(J.cols(), columns);
  ASSERT_EQ(J_end.rows(), tangent);
  ASSERT_EQ(J_end.cols(), columns);

  VectorXd plain_errors(errors.size()), plain_end(x_end.size());
  ASSERT_TRUE(
      rollout(x0.data(), theta.data(), plain_errors.data(), plain_end.data()));
  EXPECT_LT((errors - plain_errors).norm(), 1e-12 * plain_errors.norm());
  EXPECT_LT((x_end - plain_end).norm(), 1e-12 * plain_end.norm());

  for (int column = 0; column < columns; ++column) {
    const auto moved = [&](double h) {
      VectorXd x = x0, th = theta;
      if (column < tangent) {
        const VectorXd dx = h * VectorXd::Unit(tangent, column);
        BoxPlus<double>(model, x0.data(), dx.data(), x.data());
      } else {
        th[column - tangent] += h;
      }
      VectorXd out(errors.size() + tangent), end(x_end.size());
      EXPECT_TRUE(rollout(x.data(), th.data(), out.data(), end.data()));
      BoxMinus<double>(model, end.data(), plain_end.data(),
                       out.data() + errors.size());
      return out;
    };
    const auto difference = RiddersDifference(moved, 2e-3);
    VectorXd by_jets(errors.size() + tangent);
    by_jets << J.col(column), J_end.col(column);
    ASSERT_TRUE(by_jets.allFinite());
    EXPECT_LT((by_jets - difference.value).norm(),
              1e-7 * (1.0 + by_jets.norm()))
        << (column < tangent ? "tangent " + std::to_string(column)
                             : map.names()[column - tangent]);
  }
}

INSTANTIATE_TEST_SUITE_P(Columns, LinearizeTest,
                         testing::Values(0, 4, 5, 12, 13, 21, 36, 37, 70));

TEST(SegmentRollout, LinearizesTheStateAlone) {
  const Model model = ModelWithEffects();
  const ParameterMap map(model, SomeParameters(model, 30));
  Random random(3);
  const VectorXd x0 = RandomX(model, &random);
  const sysid::Run run = MeasureEverything(model, x0, 6, 0.02, 0.1, &random);
  const Measurements measurements =
      MeasurementsOf(model.mechanism(), run, OrientationResidual::kHeading);
  const SegmentRollout rollout(&model, &map, &measurements, 0, 5, {});
  const VectorXd theta = ThetaOf(map);
  VectorXd errors(rollout.num_residuals()), x_end(model.state_size());
  RowMatrixXd J, J_end, J_all, J_end_all;
  ASSERT_TRUE(rollout.Linearize(x0.data(), theta.data(), false, errors.data(),
                                x_end.data(), &J, &J_end));
  ASSERT_TRUE(rollout.Linearize(x0.data(), theta.data(), true, errors.data(),
                                x_end.data(), &J_all, &J_end_all));
  const int tangent = model.tangent_size();
  ASSERT_EQ(J.cols(), tangent);
  EXPECT_LT((J - J_all.leftCols(tangent)).norm(), 1e-12 * J.norm());
  EXPECT_LT((J_end - J_end_all.leftCols(tangent)).norm(), 1e-12 * J_end.norm());
}

TEST(SegmentRollout, HasNoRowForAMissingSample) {
  const Model model{AllJoints()};
  const ParameterMap map(model, {});
  Random random(4);
  const VectorXd x0 = RandomX(model, &random);
  sysid::Run run = MeasureEverything(model, x0, 10, 0.02, 0.0, &random);
  run.channels[0].values.row(3).setConstant(kNaN);
  run.channels[2].values.row(3).setConstant(kNaN);
  run.channels[2].values.row(0).setConstant(kNaN);
  run.channels.back().values.setConstant(kNaN);
  const Measurements measurements =
      MeasurementsOf(model.mechanism(), run, OrientationResidual::kHeading);
  const SegmentRollout rollout(&model, &map, &measurements, 0, 9, {});
  int next = 0;
  for (const SegmentRow& row : rollout.rows()) {
    EXPECT_FALSE(std::isnan(run.channels[row.channel].values(row.sample, 0)));
    EXPECT_EQ(row.first, next);
    EXPECT_EQ(row.size, ResidualSize(measurements.residuals[row.channel]));
    next += row.size;
  }
  EXPECT_EQ(rollout.num_residuals(), next);
  int measured = 0;
  for (const Channel& channel : run.channels) {
    const auto first = channel.values.col(0).array();
    measured += static_cast<int>((first == first).count());
  }
  EXPECT_EQ(static_cast<int>(rollout.rows().size()), measured);
  // What is left is compared at the right samples.
  std::vector<double> errors(next), x_end(model.state_size());
  const double* no_theta = nullptr;
  ASSERT_TRUE(rollout(x0.data(), no_theta, errors.data(), x_end.data()));
  for (const double error : errors) EXPECT_NEAR(error, 0.0, 1e-12);
}

TEST(SegmentRollout, OfNeighboursCoverEverySampleOnce) {
  const Model model{AllJoints()};
  const ParameterMap map(model, {});
  Random random(5);
  const VectorXd x0 = RandomX(model, &random);
  const sysid::Run run = MeasureEverything(model, x0, 11, 0.02, 0.0, &random);
  const Measurements measurements =
      MeasurementsOf(model.mechanism(), run, OrientationResidual::kHeading);
  std::vector<int> seen(run.size(), 0);
  const int cuts[] = {0, 4, 7, 10};
  for (int s = 0; s < 3; ++s) {
    const SegmentRollout rollout(&model, &map, &measurements, cuts[s],
                                 cuts[s + 1], {});
    for (const SegmentRow& row : rollout.rows()) {
      if (row.channel == 0) ++seen[row.sample];
    }
  }
  EXPECT_THAT(seen, testing::Each(1));
}

TEST(SegmentRollout, StartsInTheMiddleOfARunWithItsEfforts) {
  const Model model = ModelWithEffects();
  const ParameterMap map(model, {});
  Random random(6);
  const VectorXd x0 = RandomX(model, &random);
  const sysid::Run run = MeasureEverything(model, x0, 11, 0.02, 0.0, &random);
  const RowMatrixXd states = StatesOf(model, run, x0);
  const Measurements measurements =
      MeasurementsOf(model.mechanism(), run, OrientationResidual::kHeading);
  const SegmentRollout rollout(&model, &map, &measurements, 4, 9, {});
  std::vector<double> errors(rollout.num_residuals()), visited;
  VectorXd x_end(model.state_size());
  const double* no_theta = nullptr;
  ASSERT_TRUE(rollout(states.row(4).data(), no_theta, errors.data(),
                      x_end.data(), &visited));
  EXPECT_LT((x_end.transpose() - states.row(9)).norm(), 1e-13 * x_end.norm());
  ASSERT_EQ(visited.size(), static_cast<size_t>(6 * model.state_size()));
  const Eigen::Map<const RowMatrixXd> rows(visited.data(), 6,
                                           model.state_size());
  EXPECT_LT((rows - states.middleRows(4, 6)).norm(), 1e-12);
}

TEST(SegmentRollout, DividesTheTimeBetweenSamplesEvenly) {
  const Model model{AllJoints()};
  Random random(7);
  const VectorXd x0 = RandomX(model, &random);
  sysid::Run run = MeasureEverything(model, x0, 3, 0.01, 0.0, &random);
  run.t = {0.0, 0.01, 0.023};  // 1 and 2 steps of at most 0.01 s
  const auto by_hand = [&](const std::vector<int>& parts) {
    Workspace<double> ws(model);
    Stepper<double> stepper(Integrator::kRungeKutta4, &ws);
    VectorXd x = x0;
    for (int k = 0; k < 2; ++k) {
      const double h = (run.t[k + 1] - run.t[k]) / parts[k];
      for (int s = 0; s < parts[k]; ++s) {
        EXPECT_TRUE(stepper.Step(h, run.effort.row(k).data(), x.data()));
      }
    }
    return x;
  };
  const auto rolled = [&](double step) {
    return VectorXd(StatesOf(model, run, x0, {Integrator::kRungeKutta4, step})
                        .row(2)
                        .transpose());
  };
  EXPECT_EQ(rolled(0.0), by_hand({1, 1}));
  EXPECT_EQ(rolled(0.01), by_hand({1, 2}));
  EXPECT_EQ(rolled(0.01 * (1 - 1e-12)), by_hand({1, 2}));  // but for rounding
  EXPECT_EQ(rolled(0.003), by_hand({4, 5}));
  EXPECT_EQ(rolled(1.0), by_hand({1, 1}));
}

TEST(SegmentRollout, MeasuresWithTheSensorsOffset) {
  const Mechanism mechanism = AllJoints();
  Model model(mechanism);
  model.AddEffect(Catalogue().Make("sensor_offset@hinge", mechanism, ""));
  Random random(8);
  const VectorXd x0 = RandomX(model, &random);
  const sysid::Run run = MeasureEverything(model, x0, 5, 0.02, 0.0, &random);
  model.SetEffectParameter("hinge.sensor_offset", 0.1);
  const ParameterMap map(model, {});
  const Measurements measurements =
      MeasurementsOf(mechanism, run, OrientationResidual::kHeading);
  const SegmentRollout rollout(&model, &map, &measurements, 0, 4, {});
  VectorXd errors(rollout.num_residuals()), x_end(model.state_size());
  const double* no_theta = nullptr;
  ASSERT_TRUE(rollout(x0.data(), no_theta, errors.data(), x_end.data()));
  // The hinge's position moves alone: neither its speed nor the frames do.
  for (const SegmentRow& row : rollout.rows()) {
    const bool offset = run.channels[row.channel].name == "hinge";
    EXPECT_NEAR(errors.segment(row.first, row.size).norm(),
                offset ? 2.0 * std::sin(0.05) : 0.0, 1e-12)
        << run.channels[row.channel].name;
  }
}

TEST(SegmentRollout, FailsWhereTheDynamicsDo) {
  Mechanism mechanism;
  mechanism.AddRoot("base");
  AddSomeJoint("hinge", JointType::kRevolute, 0, "link", {}, &mechanism);
  const Model model(mechanism);
  sysid::Run run;
  run.t = {0.0, 0.1};
  run.effort.setZero(2, 1);
  const ParameterMap map(model, {});
  const Measurements measurements{&run, {}};
  const SegmentRollout rollout(&model, &map, &measurements, 0, 1, {});
  const double x0[] = {0.1, 0.0};
  double x_end[2];
  const double* no_theta = nullptr;
  double* no_errors = nullptr;
  EXPECT_FALSE(rollout(x0, no_theta, no_errors, x_end));
  RowMatrixXd J, J_end;
  EXPECT_FALSE(
      rollout.Linearize(x0, no_theta, false, no_errors, x_end, &J, &J_end));
}

}  // namespace
}  // namespace sysid
