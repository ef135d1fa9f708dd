#include "sysid/estimation/estimate_draws.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "models/physical.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

sysid::Run Swing(const Model& model, double noise) {
  SimulationOptions options;
  options.duration = 3.0;
  options.noise = noise;
  options.seed = 5;
  return Simulate(model, RandomState(model, 0.6, 5), options);
}

ShootingProblem Problem(const Model& model, const std::vector<Value>& free,
                        double noise = 1e-3) {
  return ShootingProblem(model, FreeFrom(model, free), {Swing(model, noise)},
                         {});
}

// With this covariance of theta, whatever data say.
Estimates WithCovariance(const MatrixXd& C) {
  Estimates estimates;
  estimates.parameters.resize(C.rows());
  estimates.theta_covariance = C;
  return estimates;
}

// The chance of an entry beyond five of its standard deviations is 6e-7.
constexpr double kChance = 5.0;

TEST(DrawFromEstimate, HasTheMeanAndTheCovarianceOfTheFit) {
  const Model model = Shipped("pendulum2_planar", {"viscous_damping@joint1"},
                              {{"joint1.damping", 0.05}});
  const ShootingProblem problem = Problem(
      model,
      {{"link1.length", 0.5}, {"link2.length", 0.5}, {"joint1.damping", 0.05}});
  const Fit fit = FitLevenbergMarquardt(problem);
  ASSERT_TRUE(fit.converged);
  constexpr int kDraws = 20000;
  const EstimateDraws draws =
      DrawFromEstimate(problem, fit.point.theta, fit, kDraws, 7);
  EXPECT_EQ(draws.failure, "");
  const MatrixXd& C = fit.covariance;
  const VectorXd mean = draws.values.colwise().mean();
  const MatrixXd off = draws.values.rowwise() - mean.transpose();
  const MatrixXd sampled = off.transpose() * off / (kDraws - 1);
  // Correlations are what is to be seen.
  EXPECT_GT(std::abs(C(0, 1)), 0.1 * std::sqrt(C(0, 0) * C(1, 1)));
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::sqrt(C(i, i)), fit.parameters[i].std_error,
                1e-12 * fit.parameters[i].std_error);
    EXPECT_NEAR(mean[i], fit.parameters[i].value,
                kChance * std::sqrt(C(i, i) / kDraws));
    for (int j = 0; j < 3; ++j) {
      // The variance of a covariance of normal numbers.
      const double variance = (C(i, i) * C(j, j) + C(i, j) * C(i, j)) / kDraws;
      EXPECT_NEAR(sampled(i, j), C(i, j), kChance * std::sqrt(variance))
          << i << " " << j;
    }
  }
}

TEST(DrawFromEstimate, DerivesFromTheSeedAlone) {
  const Model model = Shipped("pendulum2_planar");
  const ShootingProblem problem =
      Problem(model, {{"link1.length", 0.5}, {"link2.length", 0.5}});
  const VectorXd theta = problem.InitialTheta();
  MatrixXd C(2, 2);
  C << 1e-4, 5e-5, 5e-5, 4e-4;
  const auto draw = [&](int count, std::uint64_t seed) {
    return DrawFromEstimate(problem, theta, WithCovariance(C), count, seed)
        .values;
  };
  EXPECT_EQ(draw(10, 3), draw(10, 3));
  // More of them begin with the same ones.
  EXPECT_EQ(draw(10, 3), draw(20, 3).topRows(10));
  EXPECT_NE(draw(10, 3), draw(10, 4));
}

// Deviations as large as theta's own unit: entries that move one by one would
// violate the triangle inequality in most draws.
TEST(DrawFromEstimate, DrawsPossibleBodies) {
  const Model model = Shipped("pendulum2_planar");
  std::vector<Value> free;
  for (const char* name : {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"}) {
    const Parameter parameter =
        FindParameters(model, {std::string("link2.") + name}, "").front();
    free.push_back({parameter.name, parameter.nominal});
  }
  const ShootingProblem problem = Problem(model, free);
  const EstimateDraws draws =
      DrawFromEstimate(problem, problem.InitialTheta(),
                       WithCovariance(MatrixXd::Identity(6, 6)), 200, 1);
  ASSERT_EQ(draws.values.rows(), 200);
  std::vector<Parameter> parameters = problem.map().parameters();
  for (int i = 0; i < draws.values.rows(); ++i) {
    Model drawn = model;
    const VectorXd row = draws.values.row(i);
    SetParameters(parameters, {row.data(), row.data() + row.size()}, &drawn);
    EXPECT_EQ(ToString(PhysicalFaults(drawn.mechanism(), drawn.nominal()),
                       drawn.mechanism()),
              "");
  }
}

// Given that it is not below the bound where the estimate is, a normal number
// is half-normal.
TEST(DrawFromEstimate, IsTruncatedByTheBounds) {
  const Model model = Shipped("pendulum2_planar", {"viscous_damping@joint1"});
  const ShootingProblem problem = Problem(model, {{"joint1.damping", 0.0}});
  constexpr int kDraws = 4000;
  constexpr double kStd = 0.01;
  const EstimateDraws draws = DrawFromEstimate(
      problem, VectorXd::Zero(1),
      WithCovariance(MatrixXd::Constant(1, 1, kStd * kStd)), kDraws, 2);
  ASSERT_EQ(draws.values.rows(), kDraws);
  EXPECT_GE(draws.values.minCoeff(), 0.0);
  EXPECT_GT(draws.values.minCoeff(), 1e-9);  // none is clamped
  EXPECT_NEAR(draws.values.mean(), kStd * std::sqrt(2.0 / M_PI),
              kChance * kStd * std::sqrt((1.0 - 2.0 / M_PI) / kDraws));
}

// A factor of gravity and all masses shows in no motion.
TEST(DrawFromEstimate, HoldsTheCombinationsThatTheDataDoNotDetermine) {
  const Model model = Shipped("pendulum2_planar");
  const ShootingProblem problem = Problem(
      model, {{"link1.mass", 1.0}, {"link2.mass", 1.0}, {"gravity", 9.81}});
  const Fit fit = FitLevenbergMarquardt(problem);
  ASSERT_EQ(fit.not_identifiable.size(), 1u);
  const EstimateDraws draws =
      DrawFromEstimate(problem, fit.point.theta, fit, 500, 3);
  ASSERT_EQ(draws.failure, "");
  // Both together, in their own sizes, hardly move; their ratio does.
  double together = 0.0, ratio = 0.0;
  for (int i = 0; i < 500; ++i) {
    const VectorXd off = draws.values.row(i).transpose() - fit.point.theta;
    const double a = off[0] / fit.point.theta[0];
    const double b = off[1] / fit.point.theta[1];
    together = std::max(together, std::abs(a + b));
    ratio = std::max(ratio, std::abs(a - b));
  }
  EXPECT_GT(ratio, fit.parameters[2].std_error / 9.81);
  EXPECT_LT(together, 0.01 * ratio);
}

// As inverse dynamics may have it: a direction that shows in the equations by
// no more than rounding.
TEST(DrawFromEstimate, HoldsWhatIsNotKnownToItsOwnSize) {
  const Model model = Shipped("pendulum2_planar");
  const ShootingProblem problem =
      Problem(model, {{"link1.mass", 1.0}, {"link2.mass", 1.0}});
  const Eigen::Vector2d sum(1.0, 1.0), difference(1.0, -1.0);
  Estimates estimates = WithCovariance(
      1e6 * sum * sum.transpose() + 1e-4 * difference * difference.transpose());
  for (ParameterEstimate& p : estimates.parameters) p.identifiable = false;
  const MatrixXd draws =
      DrawFromEstimate(problem, Eigen::Vector2d(1.0, 1.0), estimates, 100, 1)
          .values;
  ASSERT_EQ(draws.rows(), 100);
  // What is left of 1e6 is rounding.
  EXPECT_LT((draws.rowwise().sum().array() - 2.0).abs().maxCoeff(), 1e-3);
  EXPECT_GT((draws.col(0) - draws.col(1)).cwiseAbs().maxCoeff(), 1e-2);
}

TEST(DrawFromEstimate, HoldsWhatIsAtABound) {
  const Model model = Shipped("pendulum2_planar", {"viscous_damping@joint1"});
  const ShootingProblem problem = Problem(
      model,
      {{"link1.length", 0.5}, {"joint1.damping", 0.0}, {"link2.length", 0.5}});
  MatrixXd C = MatrixXd::Zero(3, 3);
  C(0, 0) = C(2, 2) = 1e-4;
  C(0, 2) = C(2, 0) = 7e-5;
  const EstimateDraws draws = DrawFromEstimate(problem, problem.InitialTheta(),
                                               WithCovariance(C), 100, 1);
  ASSERT_EQ(draws.failure, "");
  EXPECT_EQ(draws.values.col(1), VectorXd::Zero(100));
}

TEST(DrawFromEstimate, SaysWhyThereAreNoDraws) {
  const Model model = Shipped("pendulum2_planar");
  std::vector<FreeParameter> free =
      FreeFrom(model, {{"link1.length", 0.5}, {"link2.length", 0.5}});
  free[1].lower = 0.5 - 1e-9;
  free[1].upper = 0.5 + 1e-9;
  const ShootingProblem problem(model, free, {Swing(model, 1e-3)}, {});
  const VectorXd theta = problem.InitialTheta();
  EXPECT_EQ(DrawFromEstimate(problem, theta,
                             WithCovariance(MatrixXd::Zero(2, 2)), 3, 1)
                .failure,
            "no free parameter has a variance: the data identify none of them, "
            "or each is at a bound");
  EXPECT_EQ(
      DrawFromEstimate(problem, theta,
                       WithCovariance(1e-4 * MatrixXd::Identity(2, 2)), 3, 1)
          .failure,
      "of 13000 draws none is within all bounds; most often link2.length is "
      "beyond its own: fix it, or give it other bounds");
}

}  // namespace
}  // namespace sysid
