#include "sysid/estimation/noise.h"

#include <algorithm>
#include <cmath>

namespace sysid {
namespace {

constexpr int kMaxDegree = 8;
// What is left of the variance of Gaussian noise without its largest 2 % of
// squares: (1 - 2 (z phi(z) + Q(z))) / 0.98 at z = 2.326.
constexpr double kTrimmedVariance = 0.8732;
constexpr size_t kTrimmed = 50;              // one of so many
constexpr double kMedianOfSquares = 0.4549;  // of Gaussian noise of variance 1
constexpr double kSpike = 10.0;              // standard deviations

double RmsAtDegree(const std::vector<double>& t, const std::vector<double>& y,
                   int degree) {
  const int window = degree + 2;
  std::vector<double> squares;
  std::vector<double> w(window);
  for (size_t i = 0; i + window <= t.size(); ++i) {
    const double span = t[i + window - 1] - t[i];
    double norm2 = 0.0, e = 0.0;
    for (int j = 0; j < window; ++j) {
      double product = 1.0;
      for (int k = 0; k < window; ++k) {
        if (k != j) product *= (t[i + j] - t[i + k]) / span;
      }
      w[j] = 1.0 / product;
      norm2 += w[j] * w[j];
    }
    // Differences to the first value: the weights sum to zero, and a large
    // constant would cost digits.
    for (int j = 0; j < window; ++j) e += w[j] * (y[i + j] - y[i]);
    squares.push_back(e * e / norm2);
  }
  if (squares.empty()) return -1.0;
  const size_t count = squares.size(), trimmed = count / kTrimmed;
  std::nth_element(squares.begin(), squares.begin() + count / 2, squares.end());
  const double spike = kSpike * kSpike * squares[count / 2] / kMedianOfSquares;
  // More than every fiftieth are not the tail of a Gaussian.
  const size_t spoilt =
      std::min<size_t>(std::count_if(squares.begin(), squares.end(),
                                     [&](double e2) { return e2 > spike; }),
                       window * trimmed);
  const bool tail = spike == 0.0 || spoilt <= trimmed;
  const size_t keep = count - (tail ? trimmed : spoilt);
  std::nth_element(squares.begin(), squares.begin() + (keep - 1),
                   squares.end());
  double sum = 0.0;
  for (size_t i = 0; i < keep; ++i) sum += squares[i];
  const double bias = tail && trimmed > 0 ? kTrimmedVariance : 1.0;
  return std::sqrt(sum / (keep * bias));
}

}  // namespace

double EstimateNoise(const std::vector<double>& t,
                     const std::vector<double>& y) {
  std::vector<double> t_valid, y_valid;
  for (size_t i = 0; i < t.size(); ++i) {
    if (std::isnan(y[i])) continue;
    t_valid.push_back(t[i]);
    y_valid.push_back(y[i]);
  }
  double best = -1.0;
  for (int degree = 1; degree <= kMaxDegree; ++degree) {
    // At least three windows: a single one says nothing of a spread.
    if (static_cast<int>(t_valid.size()) < degree + 4) break;
    const double rms = RmsAtDegree(t_valid, y_valid, degree);
    if (rms < 0) break;
    if (best >= 0 && rms > 0.95 * best) {
      best = std::min(best, rms);
      // One degree may gain nothing at an inflection: look one further.
      const double next = static_cast<int>(t_valid.size()) < degree + 5
                              ? rms
                              : RmsAtDegree(t_valid, y_valid, degree + 1);
      if (next > 0.95 * best) break;
      continue;
    }
    best = rms;
  }
  return std::max(best, 0.0);
}

}  // namespace sysid
