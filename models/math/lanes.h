#pragma once

#include <cstring>

#include "models/math/types.h"
#include "models/scalars.h"

// g++ says of every function that takes lanes by value that a compiler for
// other vector registers passes them otherwise. All of them are inline here.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

namespace sysid {

// Eight columns of a Jacobian side by side: the derivatives of one number by
// eight others. They lie in one register of AVX-512, two of AVX2, four of SSE2;
// sums, and products with numbers, are the compiler's own. What is computed
// from the numbers alone is computed once for all columns.
inline constexpr int kLanes = 8;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));

inline Lanes ZeroLanes() { return Lanes{}; }

// The derivatives of a Jet, and back.
inline Lanes LanesOf(const Jet8& x) {
  Lanes out;
  std::memcpy(&out, x.v.data(), sizeof(out));
  return out;
}
inline Jet8 JetOf(double value, const Lanes& lanes) {
  Jet8 out;
  out.a = value;
  std::memcpy(out.v.data(), &lanes, sizeof(lanes));
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
