#include "sysid/io/even_times.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace sysid {
namespace {

// Times at this rate as a file with so small a digit has them.
std::vector<double> Written(double rate_hz, double digit, bool cut, int n) {
  std::vector<double> t;
  for (int k = 0; k < n; ++k) {
    const double digits = 3.0 / digit + k / (rate_hz * digit);
    t.push_back((cut ? std::floor(digits + 1e-9) : std::round(digits)) * digit);
  }
  return t;
}

TEST(FindEvenTimes, FindsTheRateOfRoundedAndCutTimes) {
  for (const bool cut : {false, true}) {
    for (const double rate_hz : {200.0, 333.0, 1000.0, 128.5}) {
      const auto even = FindEvenTimes(Written(rate_hz, 0.01, cut, 2000));
      ASSERT_TRUE(even) << rate_hz;
      EXPECT_NEAR(1.0 / even->step, rate_hz, 1e-2 * rate_hz / 100) << cut;
      EXPECT_NEAR(even->digit, 0.01, 1e-9);
    }
  }
}

TEST(FindEvenTimes, RefusesWhatNoRateExplains) {
  EXPECT_FALSE(FindEvenTimes({0, 0, 0.01, 0.01}));  // too few
  std::vector<double> t = Written(200.0, 0.01, false, 2000);
  for (size_t k = 1000; k < t.size(); ++k) t[k] += 0.5;  // a pause
  EXPECT_FALSE(FindEvenTimes(t));
  // A single repeat in even times is a slip, not a rounding.
  t = Written(100.0, 0.01, false, 100);
  t[50] = t[49];
  EXPECT_FALSE(FindEvenTimes(t));
}

}  // namespace
}  // namespace sysid
