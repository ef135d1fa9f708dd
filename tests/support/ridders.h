#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

namespace sysid {

// A derivative by differences, and its estimated error, per component.
template <class V>
struct Difference {
  V value;
  V error;
};

// df/dx at x = 0 of f: double -> an Eigen vector by Ridders' method: central
// differences of falling step, extrapolated to step zero by Neville's tableau,
// and per component the entry with the least estimated error. About 1e-12 of
// the function over the step, against 1e-10 for the best single difference.
// `step` is the first and largest step: f is smooth and defined within it.
//
// Ridders, "Accurate computation of F'(x) and F'(x)F''(x)", Advances in
// Engineering Software 4, 1982; Press et al., "Numerical Recipes", section 5.7.
template <class F>
auto RiddersDifference(const F& f, double step) {
  using V = std::decay_t<std::invoke_result_t<F, double>>;
  constexpr int kRows = 10;
  constexpr double kShrink = 1.4;
  const auto central = [&f](double h) {
    const V above = f(h);
    const V below = f(-h);
    return V((above - below) / (2.0 * h));
  };
  std::array<std::array<V, kRows>, kRows> table;
  double h = step;
  table[0][0] = central(h);
  Difference<V> best{table[0][0], table[0][0]};
  best.error.setConstant(std::numeric_limits<double>::infinity());
  for (int i = 1; i < kRows; ++i) {
    h /= kShrink;
    table[0][i] = central(h);
    double factor = kShrink * kShrink;
    for (int j = 1; j <= i; ++j) {
      table[j][i] =
          (table[j - 1][i] * factor - table[j - 1][i - 1]) / (factor - 1.0);
      factor *= kShrink * kShrink;
      for (int k = 0; k < best.error.size(); ++k) {
        const double error =
            std::max(std::abs(table[j][i][k] - table[j - 1][i][k]),
                     std::abs(table[j][i][k] - table[j - 1][i - 1][k]));
        if (error < best.error[k]) {
          best.error[k] = error;
          best.value[k] = table[j][i][k];
        }
      }
    }
  }
  return best;
}

}  // namespace sysid
