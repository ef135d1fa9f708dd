#include "sysid/diagnosis/comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace sysid {
namespace {

using Eigen::ArrayXd;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

ArrayXd Values(std::initializer_list<double> values) {
  ArrayXd array(values.size());
  std::copy(values.begin(), values.end(), array.data());
  return array;
}

TEST(DifferenceOfTest, IsTheMeanOfWhatBothHave) {
  const ErrorDifference by = DifferenceOf(Values({1.0, kNone, 3.0, 2.0}),
                                          Values({0.5, 1.0, 1.0, kNone}));
  EXPECT_DOUBLE_EQ(by.mean, 1.25);  // of 0.5 and 2
  EXPECT_DOUBLE_EQ(by.std_error, 0.75);
  // Ranks 1 and 2, both up: 3 / sqrt(5).
  EXPECT_DOUBLE_EQ(by.agreement, 3.0 / std::sqrt(5.0));
}

TEST(DifferenceOfTest, KnowsNoErrorOfOneStretchAndNothingOfNone) {
  EXPECT_TRUE(std::isinf(DifferenceOf(Values({1.0}), Values({0.0})).std_error));
  EXPECT_TRUE(std::isinf(DifferenceOf(Values({kNone}), Values({0.0})).mean));
}

TEST(DifferenceOfTest, CountsAgreementByRank) {
  // The largest against all others: (1 + 2 + 3 - 4) / sqrt(30).
  const ErrorDifference by =
      DifferenceOf(Values({0.1, 0.2, 0.3, -9.0}), ArrayXd::Zero(4));
  EXPECT_DOUBLE_EQ(by.agreement, 2.0 / std::sqrt(30.0));
}

ModelScore Of(const ArrayXd& log_errors, int parameters = 1) {
  return {log_errors, parameters};
}
const ModelScore kZero = Of(ArrayXd::Zero(20));

TEST(BeatsTest, NeedsWhatMattersAndCertainty) {
  // Certain, but 4 % only.
  EXPECT_FALSE(Beats(Of(ArrayXd::Constant(20, std::log(0.96))), kZero, 3.0));
  const ModelScore better = Of(ArrayXd::Constant(20, std::log(0.94)));
  EXPECT_TRUE(Beats(better, kZero, 3.0));
  EXPECT_FALSE(Beats(kZero, better, 3.0));
  // Much in the mean, and half of the stretches are worse.
  ArrayXd mixed(20);
  for (int j = 0; j < 20; ++j) mixed[j] = j % 2 == 0 ? -0.9 : 0.6;
  EXPECT_TRUE(Matters(Of(mixed), kZero));
  EXPECT_FALSE(Beats(Of(mixed), kZero, 3.0));
}

TEST(BeatsTest, NeedsMoreForMoreParameters) {
  const ArrayXd tenth = ArrayXd::Constant(20, std::log(0.9));
  EXPECT_TRUE(Beats(Of(tenth, 3), kZero, 3.0));
  EXPECT_FALSE(Beats(Of(tenth, 4), kZero, 3.0));
  // Fewer are no reason to be worse.
  EXPECT_FALSE(Beats(Of(ArrayXd::Constant(20, 0.01), 0), kZero, 3.0));
}

TEST(IsAsGoodTest, AllowsAStandardError) {
  ArrayXd mixed(20);
  for (int j = 0; j < 20; ++j) mixed[j] = j % 2 == 0 ? 0.5 : -0.4;
  // Worse by 0.05, its standard error 0.1.
  EXPECT_TRUE(IsAsGood(Of(mixed), kZero));
  EXPECT_FALSE(IsAsGood(Of(mixed + 0.1), kZero));
  // Equal but for what two fits of the same force differ.
  EXPECT_TRUE(IsAsGood(Of(ArrayXd::Constant(20, 0.9e-3)), kZero));
  EXPECT_FALSE(IsAsGood(Of(ArrayXd::Constant(20, 1.1e-3)), kZero));
}

// One stretch that was hopeless makes the mean uncertain; the others agree.
TEST(BeatsTest, TakesTheStretchesWord) {
  ArrayXd a = ArrayXd::Constant(20, -0.2);
  a[7] = -40.0;
  const ErrorDifference by = DifferenceOf(ArrayXd::Zero(20), a);
  EXPECT_LT(by.mean, 3.0 * by.std_error);
  EXPECT_TRUE(Beats(Of(a), kZero, 3.0));
}

TEST(BeatsTest, TakesTheNoiseForProof) {
  ModelScore a = Of(ArrayXd::Zero(20)), b = a;
  for (int j = 0; j < 4; ++j) b.log_errors[j] = 4.0;
  EXPECT_FALSE(Beats(a, b, 3.0));  // by four of twenty
  a.at_noise = true;
  EXPECT_TRUE(Beats(a, b, 3.0));
  b.at_noise = true;
  EXPECT_FALSE(Beats(a, b, 3.0));
}

TEST(BeatsTest, PrefersWhatStaysFinite) {
  const ModelScore some = Of(ArrayXd::Constant(20, 5.0)), none = Of({});
  EXPECT_TRUE(Beats(some, none, 3.0));
  EXPECT_FALSE(Beats(none, some, 3.0));
  EXPECT_FALSE(Beats(none, none, 3.0));
}

}  // namespace
}  // namespace sysid
