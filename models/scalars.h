#pragma once

#include "ceres/jet.h"

namespace sysid {

// The closed list of scalars for which the library is compiled (each algorithm
// once, in its .cc file). Widths of Jets are multiples of the vector width: a
// Jet of 9 costs 3.4 times a Jet of 8 (docs/decisions/0002-jet-widths.md).
using Jet8 = ceres::Jet<double, 8>;
using Jet16 = ceres::Jet<double, 16>;
using Jet24 = ceres::Jet<double, 24>;

// Says a scalar to an overload without making a value of it.
template <typename T>
struct ScalarTag {};

// The number without its derivatives; for branches and checks, never for
// arithmetic. Found by argument-dependent lookup for further scalars.
inline double ValueOf(double x) { return x; }
template <int N>
double ValueOf(const ceres::Jet<double, N>& x) {
  return x.a;
}

// Whether a number may have a derivative that is not zero; unknown scalars may.
template <typename T>
bool MayMove(const T&) {
  return true;
}
inline bool MayMove(double) { return false; }
template <int N>
bool MayMove(const ceres::Jet<double, N>& x) {
  return (x.v.array() != 0.0).any();
}

}  // namespace sysid

// Expands MACRO(T) for each scalar of the closed list.
#define SYSID_FOR_EACH_SCALAR(MACRO) \
  MACRO(double)                      \
  MACRO(::sysid::Jet8)               \
  MACRO(::sysid::Jet16)              \
  MACRO(::sysid::Jet24)
