#pragma once

#include <cmath>

#include "models/math/types.h"

namespace sysid {

// Quaternions here are Hamilton, unit, and stored x, y, z, w (as Eigen does).
// A quaternion q carries vectors of the child to the parent: a_P = q a_C q*.
//
//   Exp(phi)   = (sin(|phi|/2) phi/|phi|, cos(|phi|/2))               (SO3.1)
//   Log(q)     = 2 atan2(|v|, w) v/|v|,  the short way round          (SO3.2)
//   q(t) = q0 Exp(u),  body angular velocity w:
//   du/dt = J_r(u)^-1 w = w + u x w / 2 + u x (u x w) / 12 + O(u^4)   (SO3.3)
//
// Sola, Deray, Atchuthan, "A micro Lie theory", 2018, appendix B; (SO3.3) is
// the series of its eq. 144.
// All are smooth at zero: below a threshold on |phi|^2 they switch to their
// series, which is what keeps Jets finite there.

template <typename T>
using Quaternion = Eigen::Quaternion<T>;

// (SO3.1); phi in rad.
template <typename T>
Quaternion<T> Exp(const Vector3<T>& phi) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const T angle2 = phi.squaredNorm();
  T scale;  // sin(|phi|/2) / |phi|
  T w;
  if (angle2 < T(1e-4)) {
    // Next terms: |phi|^8 / 1e7, below rounding for |phi| < 0.01.
    scale = T(0.5) - angle2 * (T(1.0 / 48.0) - angle2 * (T(1.0 / 3840.0) -
                                                         angle2 / T(645120.0)));
    w = T(1.0) -
        angle2 * (T(0.125) - angle2 * (T(1.0 / 384.0) - angle2 / T(46080.0)));
  } else {
    const T angle = sqrt(angle2);
    scale = sin(angle * T(0.5)) / angle;
    w = cos(angle * T(0.5));
  }
  Quaternion<T> q;
  q.vec() = scale * phi;
  q.w() = w;
  return q;
}

// (SO3.2); |Log| <= pi. At the half turn itself the axis is arbitrary.
template <typename T>
Vector3<T> Log(const Quaternion<T>& q) {
  using std::atan2;
  using std::sqrt;
  const T sign = q.w() < T(0.0) ? T(-1.0) : T(1.0);
  const Vector3<T> v = sign * q.vec();
  const T w = sign * q.w();
  const T n2 = v.squaredNorm();
  if (n2 < T(1e-6)) {
    // atan(x)/x with x = |v|/w.
    const T x2 = n2 / (w * w);
    return v *
           (T(2.0) / w * (T(1.0) - x2 * (T(1.0 / 3.0) - x2 * T(1.0 / 5.0))));
  }
  const T n = sqrt(n2);
  return v * (T(2.0) * atan2(n, w) / n);
}

// (SO3.3) to the order that a fourth-order Runge-Kutta step needs.
template <typename T>
Vector3<T> RightJacobianInverse(const Vector3<T>& u, const Vector3<T>& w) {
  const Vector3<T> uw = u.cross(w);
  return w + T(0.5) * uw + T(1.0 / 12.0) * u.cross(uw);
}

// The derivative of w x (w x x) by w: (w . x) 1 + w x^T - 2 x w^T.   (2.20)
inline Eigen::Matrix3d CentripetalByVelocity(const Eigen::Vector3d& w,
                                             const Eigen::Vector3d& x) {
  const double wx = w.dot(x);
  Eigen::Matrix3d V;
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) V(i, j) = w[i] * x[j] - 2.0 * x[i] * w[j];
    V(j, j) += wx;
  }
  return V;
}

// a b, written out: Eigen's product of quaternions of Jets takes temporaries.
template <typename T>
Quaternion<T> Multiply(const Quaternion<T>& a, const Quaternion<T>& b) {
  return Quaternion<T>(
      a.w() * b.w() - a.x() * b.x() - a.y() * b.y() - a.z() * b.z(),
      a.w() * b.x() + a.x() * b.w() + a.y() * b.z() - a.z() * b.y(),
      a.w() * b.y() + a.y() * b.w() + a.z() * b.x() - a.x() * b.z(),
      a.w() * b.z() + a.z() * b.w() + a.x() * b.y() - a.y() * b.x());
}

// The rotation matrix of a unit quaternion.
template <typename T>
Matrix3<T> ToMatrix(const Quaternion<T>& q) {
  const T x2 = q.x() + q.x(), y2 = q.y() + q.y(), z2 = q.z() + q.z();
  const T wx = x2 * q.w(), wy = y2 * q.w(), wz = z2 * q.w();
  const T xx = x2 * q.x(), xy = y2 * q.x(), xz = z2 * q.x();
  const T yy = y2 * q.y(), yz = z2 * q.y(), zz = z2 * q.z();
  Matrix3<T> R;
  R << T(1.0) - (yy + zz), xy - wz, xz + wy,  //
      xy + wz, T(1.0) - (xx + zz), yz - wx,   //
      xz - wy, yz + wx, T(1.0) - (xx + yy);
  return R;
}

}  // namespace sysid
