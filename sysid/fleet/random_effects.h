#pragma once

#include <array>
#include <vector>

#include "models/math/types.h"

namespace sysid {

// One parameter across many robots (docs/fleet.md sections 2 and 4).

// y and s of (F.1). s > 0.
struct RobotEstimate {
  double value = 0.0;
  double std_error = 0.0;
};

// The random-effects mean of DerSimonian and Laird, (F.3) to (F.12). What is
// not defined for so few robots is NaN.
struct RandomEffects {
  int count = 0;               // k
  double mean = 0.0;           // mu
  double std_error = 0.0;      // se
  double tau2 = 0.0;           // between-robot variance
  double tau2_variance = 0.0;  // of that estimate
  double i2 = 0.0;             // in [0, 1]
  double q = 0.0;

  // 95 % intervals: of the mean, and the range of one more robot.
  std::array<double, 2> Ci95() const;
  std::array<double, 2> Predicted95() const;
  // Of the hypothesis that the robots are equal.
  double QPValue() const;
  // The degrees of freedom of a variance v that contains tau2, (F.12); below 1
  // where hardly anything is known of tau2.
  double DegreesOfFreedom(double v) const;
};
RandomEffects PoolEstimates(const std::vector<RobotEstimate>& estimates);

// The regression on dates, (F.16) to (F.18), per unit of `dates`.
struct Drift {
  int count = 0;
  double slope = 0.0;  // b
  double std_error = 0.0;
  std::array<double, 2> ci95{};
  double intercept = 0.0;  // a, at the mean date
  double mean_date = 0.0;
  double tau2 = 0.0;
  double p_value = 1.0;
};
// At least four dates, not all the same: CHECKed.
Drift RegressOnDates(const std::vector<RobotEstimate>& estimates,
                     const std::vector<double>& dates);

// P(|t| > |x|) of Student's distribution with nu degrees of freedom.
double StudentTails(double x, double nu);

}  // namespace sysid
