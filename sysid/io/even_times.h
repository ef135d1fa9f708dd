#pragma once

#include <optional>
#include <vector>

namespace sysid {

// Times that were written with too few digits for their rate, so that many
// repeat, of rows that may have been taken at even steps.
struct EvenTimes {
  double start = 0.0, step = 0.0;  // s
  double digit = 0.0;              // s: of the times as they are written
};

// Nothing unless a fifth of the times repeat the one before, and times at even
// steps agree with each of them to within their last digit: then no other rate
// explains them. A whole number of hertz is taken where it agrees as well. `t`
// never falls.
std::optional<EvenTimes> FindEvenTimes(const std::vector<double>& t);

}  // namespace sysid
