#include "sysid/diagnosis/comparison.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "sysid/diagnosis/judgement_constants.h"

namespace sysid {

ErrorDifference DifferenceOf(const Eigen::ArrayXd& a, const Eigen::ArrayXd& b) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<double> d;
  for (Eigen::Index j = 0; j < std::min(a.size(), b.size()); ++j) {
    if (!std::isnan(a[j] - b[j])) d.push_back(a[j] - b[j]);
  }
  if (d.empty()) return {kInfinity, kInfinity, 0.0};
  const double n = static_cast<double>(d.size());
  const double mean = std::accumulate(d.begin(), d.end(), 0.0) / n;
  double squares = 0.0;
  for (const double x : d) squares += (x - mean) * (x - mean);
  // Ranks by size; differences of nothing count for neither side.
  std::sort(d.begin(), d.end(),
            [](double x, double y) { return std::abs(x) < std::abs(y); });
  double signed_ranks = 0.0, variance = 0.0;
  for (size_t i = 0; i < d.size(); ++i) {
    const double rank = static_cast<double>(i + 1);
    if (d[i] != 0.0) signed_ranks += d[i] > 0.0 ? rank : -rank;
    variance += rank * rank;
  }
  return {mean, n > 1.0 ? std::sqrt(squares / (n * (n - 1.0))) : kInfinity,
          signed_ranks / std::sqrt(variance)};
}

bool IsAsGood(const ModelScore& a, const ModelScore& b) {
  const ErrorDifference by = DifferenceOf(a.log_errors, b.log_errors);
  return by.mean <= std::max(by.std_error, kSameError);
}

bool Matters(const ModelScore& a, const ModelScore& b) {
  if (a.log_errors.size() == 0) return false;
  if (b.log_errors.size() == 0) return true;
  return DifferenceOf(b.log_errors, a.log_errors).mean >
         std::max(1, a.parameters - b.parameters) * std::log1p(kMatters);
}

bool Beats(const ModelScore& a, const ModelScore& b, double deviations) {
  if (!Matters(a, b)) return false;
  if (b.log_errors.size() == 0 || (a.at_noise && !b.at_noise)) return true;
  const ErrorDifference by = DifferenceOf(b.log_errors, a.log_errors);
  return by.mean > deviations * by.std_error || by.agreement > deviations;
}

}  // namespace sysid
