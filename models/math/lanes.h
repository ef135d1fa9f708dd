#pragma once

#include <cstring>

#include "models/math/types.h"
#include "models/scalars.h"

// g++ says of every function that takes registers by value that a compiler for
// others passes them otherwise. All of them are inline here.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

namespace sysid {

// Doubles in one register.
#if defined(__AVX512F__)
inline constexpr int kRegisterLanes = 8;
#elif defined(__AVX__)
inline constexpr int kRegisterLanes = 4;
#else
inline constexpr int kRegisterLanes = 2;
#endif

// So many numbers side by side: in a register, or in two halves. (Left to the
// compiler, a vector of two registers goes through memory; with AVX2 that took
// 15 times as long.)
template <int n>
struct Pack {
  Pack<n / 2> low, high;
};
template <>
struct Pack<kRegisterLanes> {
  double __attribute__((vector_size(kRegisterLanes * sizeof(double)))) of;
};

// Eight columns of a Jacobian side by side: the derivatives of one number by
// eight others. What is computed from numbers alone is computed once for all
// columns.
inline constexpr int kLanes = 8;
using Lanes = Pack<kLanes>;

template <int n>
inline Pack<n> operator+(const Pack<n>& a, const Pack<n>& b) {
  if constexpr (n == kRegisterLanes) {
    return {a.of + b.of};
  } else {
    return {a.low + b.low, a.high + b.high};
  }
}
template <int n>
inline Pack<n> operator-(const Pack<n>& a, const Pack<n>& b) {
  if constexpr (n == kRegisterLanes) {
    return {a.of - b.of};
  } else {
    return {a.low - b.low, a.high - b.high};
  }
}
template <int n>
inline Pack<n> operator*(const Pack<n>& a, double b) {
  if constexpr (n == kRegisterLanes) {
    return {a.of * b};
  } else {
    return {a.low * b, a.high * b};
  }
}
template <int n>
inline Pack<n> operator*(double a, const Pack<n>& b) {
  return b * a;
}
template <int n>
inline Pack<n> operator-(const Pack<n>& a) {
  return a * -1.0;
}
template <int n>
inline Pack<n>& operator+=(Pack<n>& a, const Pack<n>& b) {
  return a = a + b;
}
template <int n>
inline Pack<n>& operator-=(Pack<n>& a, const Pack<n>& b) {
  return a = a - b;
}

inline Lanes ZeroLanes() { return Lanes{}; }
inline Lanes LoadLanes(const double* from) {
  Lanes out;
  std::memcpy(&out, from, sizeof(out));
  return out;
}
inline void StoreLanes(const Lanes& lanes, double* to) {
  std::memcpy(to, &lanes, sizeof(lanes));
}
// Of the eight the one at `place` is 1; none where it is not among them.
inline Lanes UnitLanes(int place) {
  static constexpr double kUnits[2 * kLanes - 1] = {0, 0, 0, 0, 0, 0, 0, 1};
  static constexpr double kNone[kLanes] = {};
  const bool among = place >= 0 && place < kLanes;
  return LoadLanes(among ? kUnits + (kLanes - 1 - place) : kNone);
}

// The derivatives of a Jet, and back.
inline Lanes LanesOf(const Jet8& x) { return LoadLanes(x.v.data()); }
inline Jet8 JetOf(double value, const Lanes& lanes) {
  Jet8 out;
  out.a = value;
  StoreLanes(lanes, out.v.data());
  return out;
}

// Of a 3-vector.
struct Lanes3 {
  Lanes x, y, z;
};

inline Lanes3 ZeroLanes3() { return {ZeroLanes(), ZeroLanes(), ZeroLanes()}; }
inline Lanes3 LanesOf(const Vector3<Jet8>& x) {
  return {LanesOf(x[0]), LanesOf(x[1]), LanesOf(x[2])};
}
// Three rows in memory.
inline Lanes3 Load3(const Lanes* from) { return {from[0], from[1], from[2]}; }
inline void Store3(const Lanes3& a, Lanes* to) {
  to[0] = a.x;
  to[1] = a.y;
  to[2] = a.z;
}

inline Lanes3 operator+(const Lanes3& a, const Lanes3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Lanes3 operator-(const Lanes3& a, const Lanes3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Lanes3 operator*(const Lanes3& a, double b) {
  return {a.x * b, a.y * b, a.z * b};
}
inline Lanes3& operator+=(Lanes3& a, const Lanes3& b) { return a = a + b; }
inline Lanes3& operator-=(Lanes3& a, const Lanes3& b) { return a = a - b; }

// A vector times one column each.
inline Lanes3 operator*(const Eigen::Vector3d& a, const Lanes& b) {
  return {a[0] * b, a[1] * b, a[2] * b};
}
inline Lanes Dot(const Eigen::Vector3d& a, const Lanes3& b) {
  return a[0] * b.x + a[1] * b.y + a[2] * b.z;
}
inline Lanes3 Cross(const Eigen::Vector3d& a, const Lanes3& b) {
  return {a[1] * b.z - a[2] * b.y, a[2] * b.x - a[0] * b.z,
          a[0] * b.y - a[1] * b.x};
}
inline Lanes3 Cross(const Lanes3& a, const Eigen::Vector3d& b) {
  return {a.y * b[2] - a.z * b[1], a.z * b[0] - a.x * b[2],
          a.x * b[1] - a.y * b[0]};
}
inline Lanes3 operator*(const Eigen::Matrix3d& A, const Lanes3& b) {
  return {A(0, 0) * b.x + A(0, 1) * b.y + A(0, 2) * b.z,
          A(1, 0) * b.x + A(1, 1) * b.y + A(1, 2) * b.z,
          A(2, 0) * b.x + A(2, 1) * b.y + A(2, 2) * b.z};
}
// A^T b.
inline Lanes3 TransposedTimes(const Eigen::Matrix3d& A, const Lanes3& b) {
  return {A(0, 0) * b.x + A(1, 0) * b.y + A(2, 0) * b.z,
          A(0, 1) * b.x + A(1, 1) * b.y + A(2, 1) * b.z,
          A(0, 2) * b.x + A(1, 2) * b.y + A(2, 2) * b.z};
}

}  // namespace sysid
