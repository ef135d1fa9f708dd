#include "sysid/io/even_times.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sysid {
namespace {

// The start with which times at this step are nearest to all of them, and by
// how much the farthest is off.
double StartFor(const std::vector<double>& t, double step, double* off) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (size_t k = 0; k < t.size(); ++k) {
    const double start = t[k] - step * static_cast<double>(k);
    low = std::min(low, start);
    high = std::max(high, start);
  }
  *off = 0.5 * (high - low);
  return 0.5 * (low + high);
}

// Of the line through them with the least squares.
double SlopeOf(const std::vector<double>& t) {
  const auto n = static_cast<double>(t.size());
  double sum = 0.0, sum_kt = 0.0;
  for (size_t k = 0; k < t.size(); ++k) {
    const double from_middle = static_cast<double>(k) - 0.5 * (n - 1.0);
    sum_kt += from_middle * (t[k] - t[0]);
    sum += from_middle * from_middle;
  }
  return sum_kt / sum;
}

}  // namespace

std::optional<EvenTimes> FindEvenTimes(const std::vector<double>& t) {
  constexpr size_t kFewest = 20;
  constexpr double kPart = 0.2, kRounding = 1e-6;
  if (t.size() < kFewest) return std::nullopt;
  size_t repeats = 0;
  EvenTimes even;
  even.digit = std::numeric_limits<double>::infinity();
  for (size_t k = 1; k < t.size(); ++k) {
    if (t[k] == t[k - 1]) ++repeats;
    if (t[k] > t[k - 1]) even.digit = std::min(even.digit, t[k] - t[k - 1]);
  }
  if (!std::isfinite(even.digit) ||
      static_cast<double>(repeats) < kPart * static_cast<double>(t.size())) {
    return std::nullopt;
  }
  double off = 0.0;
  even.step = SlopeOf(t);
  even.start = StartFor(t, even.step, &off);
  const double most = even.digit * (1.0 + kRounding);
  if (even.step <= 0.0 || off > most) return std::nullopt;
  const double rate_hz = std::round(1.0 / even.step);
  if (rate_hz < 1.0) return even;
  const double start = StartFor(t, 1.0 / rate_hz, &off);
  if (off <= most) {
    even.step = 1.0 / rate_hz;
    even.start = start;
  }
  return even;
}

}  // namespace sysid
