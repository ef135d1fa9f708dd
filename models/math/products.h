#pragma once

#include "ceres/jet.h"
#include "models/math/types.h"

namespace sysid {

// Products of 3-vectors and 3x3 matrices, for the inner loops. A sum of two or
// three products is formed in one pass over the derivatives and lands where it
// belongs; with Eigen's own products every product of two Jets goes through
// memory (an ABA on Jets of 24 took 1.4 times as long). A destination must not
// be an operand.

// What happens to the destination.
enum class Into { kSet, kAdd, kSubtract };

template <Into into, typename Value, typename Destination>
inline void Store(const Value& value, Destination* out) {
  if constexpr (into == Into::kSet) {
    *out = value;
  } else if constexpr (into == Into::kAdd) {
    *out += value;
  } else {
    *out -= value;
  }
}

// a0 b0 + a1 b1 + a2 b2.
template <Into into, typename T>
inline void Sum3(const T& a0, const T& b0, const T& a1, const T& b1,
                 const T& a2, const T& b2, T* out) {
  Store<into>(a0 * b0 + a1 * b1 + a2 * b2, out);
}
template <Into into, int N>
inline void Sum3(const ceres::Jet<double, N>& a0,
                 const ceres::Jet<double, N>& b0,
                 const ceres::Jet<double, N>& a1,
                 const ceres::Jet<double, N>& b1,
                 const ceres::Jet<double, N>& a2,
                 const ceres::Jet<double, N>& b2, ceres::Jet<double, N>* out) {
  Store<into>(a0.a * b0.a + a1.a * b1.a + a2.a * b2.a, &out->a);
  Store<into>(a0.a * b0.v + b0.a * a0.v + a1.a * b1.v + b1.a * a1.v +
                  a2.a * b2.v + b2.a * a2.v,
              &out->v);
}

// The same with constants b.
template <typename T>
inline void Sum3OfConstants(const T& a0, double b0, const T& a1, double b1,
                            const T& a2, double b2, T* out) {
  *out = a0 * b0 + a1 * b1 + a2 * b2;
}
template <int N>
inline void Sum3OfConstants(const ceres::Jet<double, N>& a0, double b0,
                            const ceres::Jet<double, N>& a1, double b1,
                            const ceres::Jet<double, N>& a2, double b2,
                            ceres::Jet<double, N>* out) {
  out->a = a0.a * b0 + a1.a * b1 + a2.a * b2;
  out->v = a0.v * b0 + a1.v * b1 + a2.v * b2;
}

// a0 b0 - a1 b1.
template <Into into, typename T>
inline void Difference2(const T& a0, const T& b0, const T& a1, const T& b1,
                        T* out) {
  Store<into>(a0 * b0 - a1 * b1, out);
}
template <Into into, int N>
inline void Difference2(const ceres::Jet<double, N>& a0,
                        const ceres::Jet<double, N>& b0,
                        const ceres::Jet<double, N>& a1,
                        const ceres::Jet<double, N>& b1,
                        ceres::Jet<double, N>* out) {
  Store<into>(a0.a * b0.a - a1.a * b1.a, &out->a);
  Store<into>(a0.a * b0.v + b0.a * a0.v - a1.a * b1.v - b1.a * a1.v, &out->v);
}

// a b.
template <Into into, typename T>
inline void Product(const T& a, const T& b, T* out) {
  Store<into>(a * b, out);
}
template <Into into, int N>
inline void Product(const ceres::Jet<double, N>& a,
                    const ceres::Jet<double, N>& b,
                    ceres::Jet<double, N>* out) {
  Store<into>(a.a * b.a, &out->a);
  Store<into>(a.a * b.v + b.a * a.v, &out->v);
}

// a b, of vectors.
template <typename T>
inline T Dot(const Vector3<T>& a, const Vector3<T>& b) {
  T out;
  Sum3<Into::kSet>(a[0], b[0], a[1], b[1], a[2], b[2], &out);
  return out;
}

// a x b.
template <Into into, typename T>
inline void Cross(const Vector3<T>& a, const Vector3<T>& b, Vector3<T>* out) {
  Difference2<into>(a[1], b[2], a[2], b[1], &(*out)[0]);
  Difference2<into>(a[2], b[0], a[0], b[2], &(*out)[1]);
  Difference2<into>(a[0], b[1], a[1], b[0], &(*out)[2]);
}
template <typename T>
inline Vector3<T> Cross(const Vector3<T>& a, const Vector3<T>& b) {
  Vector3<T> out;
  Cross<Into::kSet>(a, b, &out);
  return out;
}

// x times a number.
template <Into into, typename T>
inline void Scale(const Vector3<T>& x, const T& by, Vector3<T>* out) {
  for (int i = 0; i < 3; ++i) Product<into>(x[i], by, &(*out)[i]);
}

// A x.
template <Into into, typename T>
inline void Apply(const Matrix3<T>& A, const Vector3<T>& x, Vector3<T>* out) {
  for (int i = 0; i < 3; ++i) {
    Sum3<into>(A(i, 0), x[0], A(i, 1), x[1], A(i, 2), x[2], &(*out)[i]);
  }
}

// A^T x.
template <Into into, typename T>
inline void ApplyTransposed(const Matrix3<T>& A, const Vector3<T>& x,
                            Vector3<T>* out) {
  for (int i = 0; i < 3; ++i) {
    Sum3<into>(A(0, i), x[0], A(1, i), x[1], A(2, i), x[2], &(*out)[i]);
  }
}

// A B.
template <typename T>
inline void Multiply(const Matrix3<T>& A, const Matrix3<T>& B,
                     Matrix3<T>* out) {
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      Sum3<Into::kSet>(A(i, 0), B(0, j), A(i, 1), B(1, j), A(i, 2), B(2, j),
                       &(*out)(i, j));
    }
  }
}

// A B with a constant B.
template <typename T>
inline void MultiplyByConstant(const Matrix3<T>& A, const Eigen::Matrix3d& B,
                               Matrix3<T>* out) {
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      Sum3OfConstants(A(i, 0), B(0, j), A(i, 1), B(1, j), A(i, 2), B(2, j),
                      &(*out)(i, j));
    }
  }
}

// A x with a constant x.
template <typename T>
inline void ApplyToConstant(const Matrix3<T>& A, const Eigen::Vector3d& x,
                            Vector3<T>* out) {
  for (int i = 0; i < 3; ++i) {
    Sum3OfConstants(A(i, 0), x[0], A(i, 1), x[1], A(i, 2), x[2], &(*out)[i]);
  }
}

// Calls fill(i, j, entry) for the 6 numbers of the lower triangle of S, and
// mirrors them.
template <typename T, typename Fill>
inline void FillSymmetric(Matrix3<T>* S, Fill fill) {
  fill(0, 0, &(*S)(0, 0));
  fill(1, 0, &(*S)(1, 0));
  fill(2, 0, &(*S)(2, 0));
  fill(1, 1, &(*S)(1, 1));
  fill(2, 1, &(*S)(2, 1));
  fill(2, 2, &(*S)(2, 2));
  (*S)(0, 1) = (*S)(1, 0);
  (*S)(0, 2) = (*S)(2, 0);
  (*S)(1, 2) = (*S)(2, 1);
}

// a b^T where that is symmetric: 6 of the 9 numbers are computed.
template <Into into, typename T>
inline void SymmetricOuter(const Vector3<T>& a, const Vector3<T>& b,
                           Matrix3<T>* out) {
  FillSymmetric(
      out, [&](int i, int j, T* entry) { Product<into>(a[i], b[j], entry); });
}

// R(q) a = a + w t + v x t, t = 2 v x a, of a unit quaternion q = x, y, z, w
// with v = (x, y, z), and a constant a.
template <typename T>
inline void TurnConstant(const T* q, const Eigen::Vector3d& a,
                         Vector3<T>* out) {
  Vector3<T> t;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    t[i] = q[j] * (2.0 * a[k]) - q[k] * (2.0 * a[j]);
  }
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    Product<Into::kSet>(q[3], t[i], &(*out)[i]);
    Difference2<Into::kAdd>(q[j], t[k], q[k], t[j], &(*out)[i]);
    (*out)[i] += a[i];
  }
}

}  // namespace sysid
