#include "sysid/stochastic/adam.h"

#include <gmock/gmock.h>

#include "models/error.h"
#include "tests/support/error_text.h"

namespace sysid {
namespace {

TEST(Adam, StepsAsComputedByHand) {
  AdamOptions options;
  options.learning_rate = 0.1;
  Adam adam(2, options);
  Eigen::VectorXd v(2);
  v << 1.0, -2.0;
  // m = 0.1 g and s = 0.001 g^2, corrected to g and g^2: a sign step.
  adam.Step(Eigen::Vector2d(4.0, -0.5), 0.1, &v);
  EXPECT_NEAR(v[0], 1.0 - 0.1 * 4.0 / (4.0 + 1e-8), 1e-15);
  EXPECT_NEAR(v[1], -2.0 + 0.1 * 0.5 / (0.5 + 1e-8), 1e-15);
  const double before = v[0];
  // m = 0.9 0.4 + 0.1 (-2) = 0.16 over 1 - 0.9^2 = 0.19;
  // s = 0.999 0.016 + 0.001 4 = 0.019984 over 1 - 0.999^2 = 0.001999.
  adam.Step(Eigen::Vector2d(-2.0, 0.0), 0.1, &v);
  EXPECT_NEAR(
      v[0],
      before - 0.1 * (0.16 / 0.19) / (std::sqrt(0.019984 / 0.001999) + 1e-8),
      1e-14);
  EXPECT_EQ(adam.steps(), 2);
}

TEST(Adam, FindsTheMinimumOfANarrowValley) {
  AdamOptions options;
  options.learning_rate = 0.05;
  options.epochs = 2000;
  options.schedule = Schedule::kExponential;
  Adam adam(2, options);
  Eigen::VectorXd v = Eigen::Vector2d(3.0, -1.0);
  for (int epoch = 1; epoch <= options.epochs; ++epoch) {
    const Eigen::Vector2d gradient(2.0 * v[0], 2e4 * v[1]);
    adam.Step(gradient, LearningRate(options, epoch), &v);
  }
  EXPECT_LT(v.norm(), 1e-3);
}

TEST(LearningRate, FallsAsTheScheduleSays) {
  AdamOptions options;
  options.learning_rate = 0.2;
  options.epochs = 100;
  options.schedule = Schedule::kConstant;
  EXPECT_EQ(LearningRate(options, 1), 0.2);
  EXPECT_EQ(LearningRate(options, 100), 0.2);
  options.schedule = Schedule::kExponential;
  EXPECT_EQ(LearningRate(options, 1), 0.2);
  EXPECT_NEAR(LearningRate(options, 51), 0.02, 1e-15);
  EXPECT_NEAR(LearningRate(options, 101), 0.002, 1e-15);
  options.schedule = Schedule::kCosine;
  EXPECT_EQ(LearningRate(options, 1), 0.2);
  EXPECT_NEAR(LearningRate(options, 51), 0.1, 1e-15);
  EXPECT_NEAR(LearningRate(options, 101), 0.0, 1e-15);
}

TEST(ParseSchedule, KnowsItsNamesAndSaysSo) {
  EXPECT_EQ(ParseSchedule("constant", "--schedule"), Schedule::kConstant);
  EXPECT_EQ(ParseSchedule("exponential", "--schedule"), Schedule::kExponential);
  EXPECT_EQ(ParseSchedule("cosine", "--schedule"), Schedule::kCosine);
  EXPECT_THAT(
      ErrorText([] { ParseSchedule("cosin", "--schedule"); }),
      testing::AllOf(testing::HasSubstr("--schedule: unknown schedule 'cosin'"),
                     testing::HasSubstr("cosine")));
}

}  // namespace
}  // namespace sysid
