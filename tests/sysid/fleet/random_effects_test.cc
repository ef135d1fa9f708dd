#include "sysid/fleet/random_effects.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sysid {
namespace {

// Estimates that scatter more than their standard errors.
std::vector<RobotEstimate> Some() {
  return {{0.10, 0.20}, {0.30, 0.10}, {0.35, 0.15}, {0.65, 0.12}, {0.02, 0.30}};
}

// (F.3) to (F.9) once more, from the definitions with plain sums.
TEST(PoolEstimates, IsTheEstimatorOfDerSimonianAndLaird) {
  double s1 = 0, s2 = 0, sy = 0;
  for (const RobotEstimate& e : Some()) {
    const double w = 1 / (e.std_error * e.std_error);
    s1 += w;
    s2 += w * w;
    sy += w * e.value;
  }
  double q = 0;
  for (const RobotEstimate& e : Some()) {
    q += std::pow((e.value - sy / s1) / e.std_error, 2);
  }
  const double tau2 = (q - 4) / (s1 - s2 / s1);
  double v1 = 0, vy = 0;
  for (const RobotEstimate& e : Some()) {
    const double v = 1 / (e.std_error * e.std_error + tau2);
    v1 += v;
    vy += v * e.value;
  }
  double h = 0;
  for (const RobotEstimate& e : Some()) {
    h += std::pow(e.value - vy / v1, 2) / (e.std_error * e.std_error + tau2);
  }
  const RandomEffects pooled = PoolEstimates(Some());
  EXPECT_GT(tau2, 0.01);
  EXPECT_NEAR(pooled.q, q, 1e-12);
  EXPECT_NEAR(pooled.tau2, tau2, 1e-14);
  EXPECT_NEAR(pooled.i2, (q - 4) / q, 1e-14);
  EXPECT_NEAR(pooled.mean, vy / v1, 1e-14);
  EXPECT_NEAR(pooled.std_error, std::sqrt(std::max(1.0, h / 4) / v1), 1e-14);
  // t(4) at 97.5 % is 2.776445 (any table).
  EXPECT_NEAR(pooled.Ci95()[1] - pooled.mean, 2.776445 * pooled.std_error,
              1e-6);
  // Chi-square with 4 degrees of freedom: exp(-q/2) (1 + q/2).
  EXPECT_NEAR(pooled.QPValue(), std::exp(-q / 2) * (1 + q / 2), 1e-12);
}

TEST(PoolEstimates, IsTheWeightedMeanWhereRobotsAreEqual) {
  const RandomEffects pooled =
      PoolEstimates({{1.0, 0.1}, {1.05, 0.1}, {0.97, 0.2}});
  EXPECT_EQ(pooled.tau2, 0.0);
  EXPECT_EQ(pooled.i2, 0.0);
  EXPECT_NEAR(pooled.mean, (100 * 1.0 + 100 * 1.05 + 25 * 0.97) / 225, 1e-14);
  EXPECT_NEAR(pooled.std_error, 1 / 15.0, 1e-14);
}

// tr((A Sigma)^2) of (F.11), by matrices.
TEST(PoolEstimates, KnowsHowWellItKnowsTheSpread) {
  const RandomEffects pooled = PoolEstimates(Some());
  const int k = pooled.count;
  Eigen::VectorXd w(k), sigma(k);
  for (int i = 0; i < k; ++i) {
    const double variance = std::pow(Some()[i].std_error, 2);
    w[i] = 1 / variance;
    sigma[i] = variance + pooled.tau2;
  }
  const Eigen::MatrixXd A =
      Eigen::MatrixXd(w.asDiagonal()) - w * w.transpose() / w.sum();
  const Eigen::MatrixXd product = A * sigma.asDiagonal();
  const double c = w.sum() - w.squaredNorm() / w.sum();
  EXPECT_NEAR(pooled.tau2_variance, 2 * (product * product).trace() / (c * c),
              1e-14);
  // Of robots that are measured alike there are k - 1.
  const RandomEffects alike =
      PoolEstimates({{1, 0.1}, {2, 0.1}, {4, 0.1}, {3, 0.1}});
  EXPECT_NEAR(alike.DegreesOfFreedom(alike.tau2 + 0.01), 3.0, 1e-9);
}

TEST(PoolEstimates, SaysWhatFewRobotsAllow) {
  const RandomEffects one = PoolEstimates({{2.0, 0.1}});
  EXPECT_EQ(one.mean, 2.0);
  EXPECT_NEAR(one.std_error, 0.1, 1e-15);
  EXPECT_TRUE(std::isnan(one.Ci95()[0]));
  const RandomEffects two = PoolEstimates({{2.0, 0.1}, {2.1, 0.1}});
  EXPECT_TRUE(std::isfinite(two.Ci95()[0]));
  EXPECT_TRUE(std::isnan(two.Predicted95()[0]));
  // One that is measured far better than the others says nothing of a spread.
  const RandomEffects best =
      PoolEstimates({{2.0, 0.001}, {2.001, 0.01}, {2.002, 0.01}});
  EXPECT_TRUE(std::isfinite(best.Ci95()[0]));
  EXPECT_TRUE(std::isnan(best.Predicted95()[0]));
}

TEST(PoolEstimates, IsTheSameInAnyUnitAndFromAnyOrigin) {
  const RandomEffects plain = PoolEstimates(Some());
  std::vector<RobotEstimate> other = Some();
  for (RobotEstimate& e : other) {
    e.value += 1e6;
  }
  EXPECT_NEAR(PoolEstimates(other).tau2, plain.tau2, 1e-8);
  other = Some();
  for (RobotEstimate& e : other) {
    e = {1e-200 * e.value, 1e-200 * e.std_error};
  }
  EXPECT_NEAR(PoolEstimates(other).i2, plain.i2, 1e-12);
  EXPECT_NEAR(PoolEstimates(other).mean / 1e-200, plain.mean, 1e-12);
}

// 95 % of 95 % intervals as promised, with three standard deviations of 2000
// draws; at least 95 % of the ranges of one more robot, which are wide where
// robots are measured unalike (docs/fleet.md).
TEST(PoolEstimates, CoversTheMeanAndOneMoreRobot) {
  constexpr int kDraws = 2000, kRobots = 10;
  constexpr double kMu = 3.0, kTau = 0.2;
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0.05, 0.3);
  int mean = 0, next = 0, silent = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<RobotEstimate> estimates;
    for (int i = 0; i < kRobots; ++i) {
      const double s = uniform(random);
      estimates.push_back(
          {kMu + kTau * normal(random) + s * normal(random), s});
    }
    const RandomEffects pooled = PoolEstimates(estimates);
    mean += pooled.Ci95()[0] < kMu && kMu < pooled.Ci95()[1];
    const double one_more = kMu + kTau * normal(random);
    const std::array<double, 2> range = pooled.Predicted95();
    silent += std::isnan(range[0]);  // says nothing, and nothing wrong
    next += range[0] < one_more && one_more < range[1];
  }
  EXPECT_GT(mean / double{kDraws}, 0.935);
  EXPECT_GT(next / (kDraws - silent + 0.0), 0.935);
  EXPECT_LT(silent / double{kDraws}, 0.15);
  EXPECT_LT(mean / double{kDraws}, 0.965);
}

TEST(RegressOnDates, FindsAPlantedDriftAndNoneWhereThereIsNone) {
  constexpr int kDraws = 400, kRobots = 20;
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  for (const double slope : {0.0, 0.5}) {
    int covered = 0, found = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      std::vector<RobotEstimate> estimates;
      std::vector<double> years;
      for (int i = 0; i < kRobots; ++i) {
        years.push_back(2020.0 + 0.25 * i);
        const double s = i % 2 == 0 ? 0.1 : 0.2;
        estimates.push_back({7.0 + slope * (years.back() - 2020.0) +
                                 0.15 * normal(random) + s * normal(random),
                             s});
      }
      const Drift drift = RegressOnDates(estimates, years);
      covered += drift.ci95[0] < slope && slope < drift.ci95[1];
      found += drift.p_value < 0.01;
    }
    EXPECT_GT(covered, 0.91 * kDraws);
    EXPECT_GE(found, slope > 0.0 ? kDraws : 0);
    EXPECT_LE(found, slope > 0.0 ? kDraws : 0.03 * kDraws);
  }
}

TEST(RegressOnDates, IsTheWeightedLineWhereNothingElseScatters) {
  const Drift drift = RegressOnDates(
      {{1.0, 0.1}, {1.5, 0.2}, {2.0, 0.1}, {2.5, 0.3}}, {0.0, 1.0, 2.0, 3.0});
  EXPECT_NEAR(drift.slope, 0.5, 1e-13);
  EXPECT_NEAR(drift.intercept, 1.75, 1e-13);
  EXPECT_EQ(drift.tau2, 0.0);
}

}  // namespace
}  // namespace sysid
