#include "sysid/stochastic/gaussian_mixture.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>
#include <vector>

#include "ceres/jet.h"
#include "tests/sysid/stochastic/stochastic_setup.h"

namespace sysid {
namespace {

GaussianMixture TwoKernels() {
  GaussianMixture mixture;
  mixture.logits = Eigen::Vector2d(std::log(3.0), 0.0);
  mixture.means.resize(2, 2);
  mixture.means << 1.0, -1.0,  //
      -0.5, 2.0;
  mixture.log_deviations.resize(2, 2);
  mixture.log_deviations << std::log(0.1), std::log(0.2),  //
      std::log(0.3), std::log(0.4);
  return mixture;
}

TEST(GaussianMixture, HasTheMomentsOfItsKernels) {
  const GaussianMixture mixture = TwoKernels();
  EXPECT_NEAR(mixture.Weights()[0], 0.75, 1e-15);
  EXPECT_NEAR(mixture.Mean()[0], 0.75 * 1.0 - 0.25 * 0.5, 1e-15);
  EXPECT_NEAR(mixture.Mean()[1], -0.75 + 0.25 * 2.0, 1e-15);
  // Within and between: E[x^2] - mean^2, and the covariance of the means.
  const Eigen::MatrixXd covariance = mixture.Covariance();
  EXPECT_NEAR(covariance(0, 0),
              0.75 * (0.01 + 1.0) + 0.25 * (0.09 + 0.25) - 0.625 * 0.625,
              1e-14);
  EXPECT_NEAR(covariance(0, 1), 0.75 * 0.25 * 1.5 * -3.0, 1e-14);
}

TEST(GaussianMixture, PacksAndUnpacks) {
  GaussianMixture other = TwoKernels();
  other.means.setZero();
  other.Unpack(TwoKernels().Pack());
  EXPECT_EQ(other.Pack(), TwoKernels().Pack());
  EXPECT_EQ(other.means, TwoKernels().means);
}

TEST(GaussianMixture, SamplesHaveItsMoments) {
  const GaussianMixture mixture = TwoKernels();
  std::mt19937_64 random(1);
  constexpr int kDraws = 100000;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  for (int i = 0; i < kDraws; ++i) {
    const Eigen::Vector2d v = mixture.Sample(&random);
    sum += v;
    squares += v * v.transpose();
  }
  const Eigen::Vector2d mean = sum / kDraws;
  const Eigen::Matrix2d covariance = squares / kDraws - mean * mean.transpose();
  // Five standard errors of deviations below 1.5.
  EXPECT_LT((mean - mixture.Mean()).norm(), 5 * 1.5 / std::sqrt(kDraws));
  EXPECT_LT((covariance - mixture.Covariance()).norm(), 0.05);
}

// At a low temperature y is nearly one-hot (the Gumbel-max trick): kernels are
// drawn by their weights, and v has the mixture's moments.
TEST(SoftDraws, AreDrawsOfTheMixtureWhenCold) {
  const GaussianMixture mixture = TwoKernels();
  std::mt19937_64 random(2);
  constexpr int kDraws = 50000;
  MixtureNoise noise;
  DrawNoise(kDraws, 2, 2, &random, &noise);
  SoftDraws draws;
  draws.Draw(mixture, noise, 1e-3);
  ASSERT_EQ(draws.count(), kDraws);
  const Eigen::Vector2d mean = draws.v().colwise().mean();
  EXPECT_LT((mean - mixture.Mean()).norm(), 5 * 1.5 / std::sqrt(kDraws));
}

TEST(SoftDraws, AreTheWeightedSumsOfTheKernelsDraws) {
  MixtureNoise noise;
  noise.gumbel.resize(2, 2);
  noise.gumbel << -1.0, 2.0,  //
      0.2, 0.9;
  noise.normal.resize(2, 4);
  noise.normal << 0.0, 0.0, 0.0, 0.0,  //
      0.5, -1.0, 2.0, 0.3;
  constexpr double kTau = 2.0 / 3.0;
  SoftDraws draws;
  draws.Draw(TwoKernels(), noise, kTau);
  const double a = std::exp((std::log(3.0) + 0.2) / kTau);
  const double b = std::exp(0.9 / kTau);
  const Eigen::Vector2d first(1.0 + 0.1 * 0.5, -1.0 - 0.2);
  const Eigen::Vector2d second(-0.5 + 0.3 * 2.0, 2.0 + 0.4 * 0.3);
  const Eigen::Vector2d v = draws.v().row(1);
  EXPECT_LT((v - (a * first + b * second) / (a + b)).norm(), 1e-14);
}

TEST(SoftDraws, SurviveLogitsFarApart) {
  GaussianMixture mixture;
  mixture.logits = Eigen::Vector2d(2000.0, -2000.0);
  mixture.means = Eigen::Vector2d(1.0, 5.0);
  mixture.log_deviations = Eigen::Vector2d(-1.0, -1.0);
  MixtureNoise noise;
  noise.gumbel = noise.normal = Eigen::ArrayXXd::Zero(1, 2);
  SoftDraws draws;
  draws.Draw(mixture, noise, 2.0 / 3.0);
  EXPECT_EQ(draws.v()(0, 0), 1.0);
}

// (9.8) against Jets of (9.4), written once more as it stands: for any dJ/dv,
// the gradient of sum a v.
TEST(SoftDraws, HaveTheGradientThatJetsHave) {
  constexpr int kKernels = 3, kSize = 2, kDraws = 5;
  constexpr int kNumbers = kKernels + 2 * kKernels * kSize;
  constexpr double kTau = 0.7;
  using Jet = ceres::Jet<double, kNumbers>;
  std::mt19937_64 random(4);
  GaussianMixture mixture = StartingMixture(kKernels, kSize, 0.4, &random);
  mixture.logits << 0.3, -0.8, 0.1;
  mixture.log_deviations(1, 0) += 0.5;
  MixtureNoise noise;
  DrawNoise(kDraws, kKernels, kSize, &random, &noise);
  Eigen::ArrayXXd a(kDraws, kSize);
  std::normal_distribution<double> normal;
  for (double& x : a.reshaped()) x = normal(random);

  const Eigen::VectorXd packed = mixture.Pack();
  std::vector<Jet> x;
  for (int i = 0; i < kNumbers; ++i) x.emplace_back(packed[i], i);
  Jet J(0.0);
  for (int d = 0; d < kDraws; ++d) {
    Jet sum(0.0), weighted(0.0);
    for (int k = 0; k < kKernels; ++k) {
      const Jet y = exp((x[k] + noise.gumbel(d, k)) / kTau);
      sum += y;
      for (int i = 0; i < kSize; ++i) {
        const int at = k * kSize + i;
        weighted += y * a(d, i) *
                    (x[kKernels + at] +
                     exp(x[kKernels * (1 + kSize) + at]) * noise.normal(d, at));
      }
    }
    J += weighted / sum;
  }

  SoftDraws draws;
  draws.Draw(mixture, noise, kTau);
  EXPECT_NEAR((draws.v() * a).sum(), J.a, 1e-14);
  EXPECT_LT((draws.Gradient(a) - J.v).norm(), 1e-14 * J.v.norm());
}

// Memory that an earlier, larger epoch left changes nothing.
TEST(SoftDraws, AreTheSameInMemoryThatIsUsedAgain) {
  std::mt19937_64 random(5);
  MixtureNoise many, few;
  DrawNoise(7, 2, 2, &random, &many);
  DrawNoise(3, 2, 2, &random, &few);
  SoftDraws again, fresh;
  again.Draw(TwoKernels(), many, 0.5);
  again.Draw(TwoKernels(), few, 0.5);
  fresh.Draw(TwoKernels(), few, 0.5);
  EXPECT_TRUE((again.v() == fresh.v()).all());
  EXPECT_EQ(again.Gradient(again.v()), fresh.Gradient(fresh.v()));
}

TEST(StartingMixture, IsTheSameForASeed) {
  std::mt19937_64 a(3), b(3), c(4);
  EXPECT_EQ(StartingMixture(3, 4, 0.3, &a).Pack(),
            StartingMixture(3, 4, 0.3, &b).Pack());
  EXPECT_NE(StartingMixture(3, 4, 0.3, &a).Pack(),
            StartingMixture(3, 4, 0.3, &c).Pack());
}

// A log-normal length: mean a + b exp(s^2/2), variance known too.
TEST(ParameterMixture, HasTheMomentsOfTransformedKernels) {
  const Model model = Shipped("pendulum2");
  std::vector<FreeParameter> free =
      FreeFrom(model, {{"link1.length", 1.1}, {"link1.com_x", 0.0}});
  free[0].lower = 0.1;
  const auto problem = AnyRunOf(model, free);
  GaussianMixture mixture = TwoKernels();
  mixture.log_deviations(0, 0) = std::log(0.4);
  const ParameterMixture in =
      InParameters(*problem, Transformation(*problem), mixture);
  const double s2 = 0.4 * 0.4;
  EXPECT_NEAR(in.means(0, 0), 0.1 + std::exp(1.0 + s2 / 2), 1e-9);
  EXPECT_NEAR(in.stds(0, 0),
              std::exp(1.0 + s2 / 2) * std::sqrt(std::exp(s2) - 1.0), 1e-9);
  EXPECT_NEAR(in.means(0, 1), 0.5 * -1.0, 1e-12);  // linear, scale 0.5 m
  EXPECT_NEAR(in.stds(1, 1), 0.5 * 0.4, 1e-12);
  const double mean = 0.75 * in.means(0, 1) + 0.25 * in.means(1, 1);
  EXPECT_NEAR(in.Mean()[1], mean, 1e-12);
  EXPECT_NEAR(in.Std()[1], 0.5 * std::sqrt(mixture.Covariance()(1, 1)), 1e-9);
}

}  // namespace
}  // namespace sysid
