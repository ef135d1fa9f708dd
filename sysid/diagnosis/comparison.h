#pragma once

#include "models/math/types.h"

namespace sysid {

// The one way in which two models are compared: (J.2) of docs/judgement.md. A
// model is what it leaves of each stretch of the data, ln e_j of (J.1): NaN
// where a stretch has no data, nothing at all where the dynamics fail.

// The mean over the stretches that both have, and its standard error (infinite
// where one stretch is all).
struct Difference {
  double mean = 0.0, std_error = 0.0;
};
// ln(error of a / error of b).
Difference DifferenceOf(const Eigen::ArrayXd& a, const Eigen::ArrayXd& b);

// By so many standard errors the best of `compared` models must be better than
// another: the largest of as many standard normal deviates, which is what
// chance makes of it, about sqrt(2 ln compared); one at least.
double Deviations(int compared);

// Whether a predicts better than b: by so many standard errors, and by what
// matters (kMatters).
bool Beats(const Eigen::ArrayXd& a, const Eigen::ArrayXd& b, double deviations);

}  // namespace sysid
