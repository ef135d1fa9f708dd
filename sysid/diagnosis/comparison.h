#pragma once

#include "models/math/types.h"
#include "sysid/diagnosis/judgement_constants.h"

namespace sysid {

// The one way in which two models are compared: (J.2) of docs/judgement.md.

// What is compared of a model.
struct ModelScore {
  // ln e_j of (J.1), by stretch: NaN where a stretch has no data, nothing at
  // all where the dynamics fail.
  Eigen::ArrayXd log_errors;
  int parameters = 0;     // beside those of the model as given
  bool at_noise = false;  // its errors may be noise alone; not of predictions
};

// Over the stretches that both have: the mean, its standard error (infinite
// where one stretch is all), and how far the stretches agree on its sign:
// Wilcoxon's signed-rank statistic as a standard normal deviate. Where a few
// stretches differ by far more than the others the mean is uncertain, and yet
// all may say the same.
struct ErrorDifference {
  double mean = 0.0, std_error = 0.0, agreement = 0.0;
};
// ln(error of a / error of b).
ErrorDifference DifferenceOf(const Eigen::ArrayXd& a, const Eigen::ArrayXd& b);

// Whether a is no worse than b by more than the standard error of the
// difference, or by what two fits of the same force differ.
bool IsAsGood(const ModelScore& a, const ModelScore& b);

// Whether a predicts better than b by what matters (kMatters), once for each
// parameter that it has more, certain or not.
bool Matters(const ModelScore& a, const ModelScore& b);

// Whether it does, and by so many deviates that the mean is certain or the
// stretches agree; or is at the noise where b is not, which is no chance.
bool Beats(const ModelScore& a, const ModelScore& b,
           double deviations = kDeviations);

}  // namespace sysid
