#include "sysid/diagnosis/comparison.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sysid/diagnosis/judgement_constants.h"

namespace sysid {

Difference DifferenceOf(const Eigen::ArrayXd& a, const Eigen::ArrayXd& b) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Eigen::Index stretches = std::min(a.size(), b.size());
  double n = 0.0, sum = 0.0, squares = 0.0;
  for (Eigen::Index j = 0; j < stretches; ++j) {
    const double d = a[j] - b[j];
    if (std::isnan(d)) continue;
    ++n, sum += d;
  }
  if (n < 1.0) return {kInfinity, kInfinity};
  const double mean = sum / n;
  for (Eigen::Index j = 0; j < stretches; ++j) {
    const double d = a[j] - b[j];
    if (!std::isnan(d)) squares += (d - mean) * (d - mean);
  }
  return {mean, n > 1.0 ? std::sqrt(squares / (n * (n - 1.0))) : kInfinity};
}

double Deviations(int compared) {
  return std::max(1.0, std::sqrt(2.0 * std::log(compared)));
}

bool Beats(const Eigen::ArrayXd& a, const Eigen::ArrayXd& b,
           double deviations) {
  if (a.size() == 0) return false;
  if (b.size() == 0) return true;
  const Difference by = DifferenceOf(b, a);
  return by.mean > std::max(deviations * by.std_error, std::log1p(kMatters));
}

}  // namespace sysid
