#include "sysid/estimation/noise.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "tests/support/random_mechanism.h"

namespace sysid {
namespace {

constexpr double kSigma = 1e-3;
constexpr int kSeeds = 20;

// A swing: two frequencies as a double pendulum has them, and an offset that is
// large beside the noise.
double Swing(double t) {
  return 100.0 + 0.5 * std::sin(2 * M_PI * 0.8 * t) +
         0.2 * std::cos(2 * M_PI * 2.1 * t + 0.3);
}

std::vector<double> Times(double duration, double rate) {
  std::vector<double> t;
  for (int k = 0; k <= std::lround(duration * rate); ++k) {
    t.push_back(k / rate);
  }
  return t;
}

std::vector<double> NoisySwing(const std::vector<double>& t, Random* random) {
  std::vector<double> y;
  for (const double time : t) {
    y.push_back(Swing(time) + kSigma * random->Normal());
  }
  return y;
}

class RateTest : public testing::TestWithParam<double> {};

TEST_P(RateTest, FindsTheNoiseOnASmoothSignal) {
  Random random(1);
  const std::vector<double> t = Times(10.0, GetParam());
  double sum = 0.0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const double sigma = EstimateNoise(t, NoisySwing(t, &random));
    EXPECT_NEAR(sigma, kSigma, 0.25 * kSigma);
    sum += sigma;
  }
  EXPECT_NEAR(sum / kSeeds, kSigma, 0.05 * kSigma);
}

INSTANTIATE_TEST_SUITE_P(Rates, RateTest,
                         testing::Values(30.0, 60.0, 100.0, 250.0, 1000.0),
                         [](const auto& info) {
                           return std::to_string(int(info.param)) + "Hz";
                         });

TEST(EstimateNoise, MindsIrregularSpacing) {
  Random random(2);
  double sum = 0.0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    std::vector<double> t;
    for (double time = 0.0; time < 10.0; time += random.Uniform(0.004, 0.016)) {
      t.push_back(time);
    }
    sum += EstimateNoise(t, NoisySwing(t, &random));
  }
  EXPECT_NEAR(sum / kSeeds, kSigma, 0.05 * kSigma);
}

TEST(EstimateNoise, SkipsMissingSamples) {
  Random random(3);
  const std::vector<double> t = Times(10.0, 100.0);
  double sum = 0.0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    std::vector<double> y = NoisySwing(t, &random);
    for (double& value : y) {
      if (random.Uniform(0, 1) < 0.3) {
        value = std::numeric_limits<double>::quiet_NaN();
      }
    }
    sum += EstimateNoise(t, y);
  }
  EXPECT_NEAR(sum / kSeeds, kSigma, 0.05 * kSigma);
}

// An encoder's steps on a moving signal are noise of step / sqrt(12).
TEST(EstimateNoise, TakesQuantisationForUniformNoise) {
  const double step = 0.01;
  const std::vector<double> t = Times(10.0, 100.0);
  std::vector<double> y;
  for (const double time : t) {
    y.push_back(step * std::round(Swing(time) / step));
  }
  EXPECT_NEAR(EstimateNoise(t, y), step / std::sqrt(12.0),
              0.15 * step / std::sqrt(12.0));
}

TEST(EstimateNoise, LeavesSpikesOut) {
  Random random(4);
  const std::vector<double> t = Times(10.0, 100.0);
  std::vector<double> y = NoisySwing(t, &random);
  y[300] += 1.0;
  EXPECT_NEAR(EstimateNoise(t, y), kSigma, 0.15 * kSigma);
}

// Each spoils as many differences as it is in.
TEST(EstimateNoise, LeavesOneSpikeInAHundredOut) {
  Random random(4);
  const std::vector<double> t = Times(10.0, 100.0);
  std::vector<double> y = NoisySwing(t, &random);
  for (size_t i = 50; i < y.size(); i += 100) y[i] += i % 200 == 50 ? 1 : -1;
  EXPECT_NEAR(EstimateNoise(t, y), kSigma, 0.15 * kSigma);
}

TEST(EstimateNoise, FindsNextToNothingWithoutNoise) {
  const std::vector<double> t = Times(10.0, 100.0);
  std::vector<double> y;
  for (const double time : t) y.push_back(Swing(time));
  EXPECT_LT(EstimateNoise(t, y), 1e-6);
}

TEST(EstimateNoise, IsZeroForTooFewSamples) {
  EXPECT_EQ(EstimateNoise({}, {}), 0.0);
  EXPECT_EQ(EstimateNoise({0.0, 0.1, 0.2}, {1.0, 5.0, 2.0}), 0.0);
}

TEST(EstimateNoise, IsZeroForAConstant) {
  const std::vector<double> t = Times(1.0, 100.0);
  EXPECT_EQ(EstimateNoise(t, std::vector<double>(t.size(), 3.3)), 0.0);
}

}  // namespace
}  // namespace sysid
