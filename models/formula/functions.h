#pragma once

#include <cmath>
#include <cstdlib>

#include "models/scalars.h"

// What a syntax tree (syntax_tree.h) does to its operands, for any scalar.
//
// The library's functions, but with finite derivatives wherever the value is
// finite: where a slope is infinite (the square root at 0, the arc sine at 1)
// or does not exist (the hypotenuse at the origin), it is 0. A Jet would have
// NaN there, as would all that depends on it.
namespace sysid::formula {

// The slope at 0 is that to the right, so that a parameter can leave 0.
template <typename T>
T Absolute(const T& x) {
  return ValueOf(x) < 0.0 ? T(-x) : x;
}

// NaN of NaN.
template <typename T>
T Sign(const T& x) {
  const double value = ValueOf(x);
  return T(value > 0.0 ? 1.0 : value < 0.0 ? -1.0 : value);
}

template <typename T>
T SquareRoot(const T& x) {
  using std::sqrt;
  return ValueOf(x) == 0.0 ? T(0.0) : T(sqrt(x));
}

template <typename T>
T ArcSine(const T& x) {
  using std::asin;
  const double value = ValueOf(x);
  return std::abs(value) == 1.0 ? T(std::asin(value)) : T(asin(x));
}

template <typename T>
T ArcCosine(const T& x) {
  using std::acos;
  const double value = ValueOf(x);
  return std::abs(value) == 1.0 ? T(std::acos(value)) : T(acos(x));
}

template <typename T>
T ArcTangent2(const T& y, const T& x) {
  using std::atan2;
  const double y_value = ValueOf(y), x_value = ValueOf(x);
  if (y_value == 0.0 && x_value == 0.0) return T(std::atan2(y_value, x_value));
  return atan2(y, x);
}

template <typename T>
T Hypotenuse(const T& x, const T& y) {
  using std::hypot;
  if (ValueOf(x) == 0.0 && ValueOf(y) == 0.0) return T(0.0);
  return hypot(x, y);
}

// Of equals the first; NaN where one is NaN.
template <typename T>
T Smaller(const T& x, const T& y) {
  return ValueOf(y) < ValueOf(x) || std::isnan(ValueOf(y)) ? y : x;
}
template <typename T>
T Greater(const T& x, const T& y) {
  return ValueOf(y) > ValueOf(x) || std::isnan(ValueOf(y)) ? y : x;
}

// x^n by products: as exact as they are, with the derivatives of x < 0 and 0.
template <typename T>
T WholePower(const T& x, int n) {
  if (n == 0) return T(1.0);
  T factor = x;
  int left = std::abs(n);
  for (; left % 2 == 0; left /= 2) factor = T(factor * factor);
  T power = factor;
  while ((left /= 2) > 0) {
    factor = T(factor * factor);
    if (left % 2 == 1) power = T(power * factor);
  }
  return n < 0 ? T(T(1.0) / power) : power;
}

// x^y. A negative x has a value where y is whole, and a derivative by y
// nowhere.
template <typename T>
T Power(const T& x, const T& y) {
  using std::pow;
  const double base = ValueOf(x), exponent = ValueOf(y);
  if (base == 0.0) return exponent == 1.0 ? x : T(std::pow(base, exponent));
  if (!MayMove(y)) return pow(x, exponent);
  return pow(x, y);
}

}  // namespace sysid::formula
