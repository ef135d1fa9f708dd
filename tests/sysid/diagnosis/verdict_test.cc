#include "sysid/diagnosis/verdict.h"

#include <gtest/gtest.h>

#include "tests/sysid/diagnosis/stretches.h"

namespace sysid {
namespace {

TEST(ExplainsMost, IsHalfOfALargeError) {
  const CrossValidation before = Of({100.0, 100.0, 100.0});
  EXPECT_TRUE(ExplainsMost(before, Of({49.0, 49.0, 49.0})));
  EXPECT_FALSE(ExplainsMost(before, Of({51.0, 51.0, 51.0})));
}

TEST(ExplainsMost, CountsFromTheNoiseFloor) {
  const CrossValidation before = Of({2.0, 2.0, 2.0});
  EXPECT_TRUE(ExplainsMost(before, Of({1.3, 1.3, 1.3})));  // 1.69 < 1.75
  EXPECT_FALSE(ExplainsMost(before, Of({1.35, 1.35, 1.35})));
}

TEST(ExplainsMost, IsDeniedWithinAStandardErrorOnly) {
  const CrossValidation before = Of({100.0, 100.0, 100.0});
  const CrossValidation scattered = Of({20.0, 60.0, 150.0});  // 56 on average
  EXPECT_FALSE(ExplainsMost(before, scattered));
  EXPECT_TRUE(ExplainsMost(before, scattered, 1.0));
  EXPECT_FALSE(ExplainsMost(before, Of({56.0, 57.0, 58.0}), 1.0));
}

TEST(ExplainsMost, HoldsOfModelsThatCannotBeFollowed) {
  const CrossValidation none, some = Of({100.0, 100.0});
  EXPECT_TRUE(ExplainsMost(none, some, 1.0));
  EXPECT_FALSE(ExplainsMost(some, none, 1.0));
  // Of a single stretch there is no standard error.
  EXPECT_FALSE(ExplainsMost(Of({100.0}), Of({60.0})));
}

// By the mean over joints of what is left of each one's mean square.
TEST(ExplainsMostEffort, IsThreeQuartersOfTheMeanSquares) {
  Fit given{Model(Mechanism())}, found = given;
  EXPECT_FALSE(ExplainsMostEffort(given, found));  // no efforts
  given.effort = {{"a", 10.0, 90.0}, {"b", 2.0, 50.0}};
  found.effort = {{"a", 1.0, 9.0}, {"b", 1.2, 30.0}};  // 0.01 and 0.36
  EXPECT_TRUE(ExplainsMostEffort(given, found));
  found.effort[1].rms = 1.6;  // 0.64: 0.325 on the average
  EXPECT_FALSE(ExplainsMostEffort(given, found));
}

}  // namespace
}  // namespace sysid
