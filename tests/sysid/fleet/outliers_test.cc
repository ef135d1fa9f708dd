#include "sysid/fleet/outliers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sysid {
namespace {

// Robots that differ by tau, with standard errors over a decade about it.
class Fleets {
 public:
  explicit Fleets(uint64_t seed) : random_(seed) {}
  std::vector<RobotEstimate> Draw(int robots, double tau) {
    std::uniform_real_distribution<double> decade(-1.5, -0.5);
    std::vector<RobotEstimate> estimates;
    for (int i = 0; i < robots; ++i) {
      const double s = std::pow(10.0, decade(random_));
      estimates.push_back(
          {1.0 + tau * normal_(random_) + s * normal_(random_), s});
    }
    return estimates;
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

int Count(const std::vector<bool>& outlier) {
  int count = 0;
  for (const bool one : outlier) count += one;
  return count;
}

// At most 1 % of fleets without an outlier have one named: of 600 fewer than
// 14, three standard deviations above. Fleets of any size, robots that are
// equal or differ.
TEST(FindOutliers, NamesNoneWhereThereIsNone) {
  for (const int robots : {6, 15, 40}) {
    for (const double tau : {0.0, 0.1, 1.0}) {
      Fleets fleets(robots);
      int named = 0;
      for (int draw = 0; draw < 600; ++draw) {
        named += Count(FindOutliers(fleets.Draw(robots, tau), robots)) > 0;
      }
      EXPECT_LT(named, 14) << robots << " robots, tau " << tau;
    }
  }
}

// Up to a fifth of the fleet that lie together would mask each other.
TEST(FindOutliers, NamesAllThatWerePlantedAndNoOther) {
  for (const int planted : {1, 2, 4, 8}) {
    Fleets fleets(100 + planted);
    int exact = 0;
    for (int draw = 0; draw < 100; ++draw) {
      std::vector<RobotEstimate> estimates = fleets.Draw(40, 0.05);
      // Nine of the largest standard errors.
      for (int i = 0; i < planted; ++i) estimates[5 * i].value += 3.0;
      const std::vector<bool> outlier = FindOutliers(estimates, 120);
      bool right = true;
      for (int i = 0; i < 40; ++i) {
        right = right && outlier[i] == (i % 5 == 0 && i < 5 * planted);
      }
      exact += right;
    }
    EXPECT_GE(exact, 95) << planted;
  }
}

TEST(FindOutliers, NamesAMinorityOnly) {
  std::vector<RobotEstimate> estimates(11, {1.0, 0.01});
  for (int i = 0; i < 5; ++i) estimates[i].value = 2.0;
  const std::vector<bool> outlier = FindOutliers(estimates, 11);
  for (int i = 0; i < 11; ++i) EXPECT_EQ(outlier[i], i < 5);
}

TEST(FindOutliers, NamesNoneOfFourOrFewerThatCannotBeCompared) {
  EXPECT_EQ(Count(FindOutliers({}, 1)), 0);
  EXPECT_EQ(Count(FindOutliers({{1, 0.1}, {9, 0.1}, {1, 0.1}}, 3)), 0);
}

TEST(CompareWithOthers, HasNoPartInTheirMean) {
  const Deviation far = CompareWithOthers(
      {5.0, 0.1}, {{1.0, 0.1}, {1.0, 0.1}, {1.0, 0.1}, {1.0, 0.1}});
  EXPECT_NEAR(far.others.mean, 1.0, 1e-14);
  EXPECT_NEAR(far.deviation, 4.0 / std::sqrt(0.01 + 0.01 / 4), 1e-12);
  EXPECT_NEAR(far.p_value, StudentTails(far.deviation, 3), 1e-15);
  const Deviation none = CompareWithOthers({5.0, 0.1}, {{1, 1}, {1, 1}});
  EXPECT_TRUE(std::isnan(none.deviation));
  EXPECT_EQ(none.p_value, 1.0);
}

}  // namespace
}  // namespace sysid
