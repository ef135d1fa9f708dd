#pragma once

#include "models/math/products.h"
#include "models/math/rotation.h"

// Matrices of 3 x 3 in other axes, and symmetric ones, of which only one half
// is computed.

namespace sysid {
namespace internal {

template <typename T>
Vector3<T> Rotate(const Eigen::Matrix3d& R, const Vector3<T>& v) {
  Vector3<T> out;
  for (int i = 0; i < 3; ++i) {
    out[i] = v[0] * R(i, 0) + v[1] * R(i, 1) + v[2] * R(i, 2);
  }
  return out;
}

template <typename T>
Matrix3<T> RotateMatrix(const Eigen::Matrix3d& R, const Matrix3<T>& m) {
  Matrix3<T> out;
  for (int j = 0; j < 3; ++j) {
    const Vector3<T> column = m.col(j);
    out.col(j) = Rotate<T>(R, column);
  }
  return out;
}

// R S R^T of a symmetric S with a constant R.
template <typename T>
Matrix3<T> Congruence(const Eigen::Matrix3d& R, const Matrix3<T>& S) {
  const Matrix3<T> left = RotateMatrix<T>(R, S);
  return RotateMatrix<T>(R, Matrix3<T>(left.transpose()));
}

// R S R^T of a symmetric S.
template <typename T>
void SymmetricCongruence(const Matrix3<T>& R, const Matrix3<T>& S,
                         Matrix3<T>* out) {
  Matrix3<T> RS;
  Multiply(R, S, &RS);
  FillSymmetric(out, [&](int i, int j, T* entry) {
    Sum3<Into::kSet>(RS(i, 0), R(j, 0), RS(i, 1), R(j, 1), RS(i, 2), R(j, 2),
                     entry);
  });
}

// M - H^T W where that is symmetric.
template <typename T>
void SubtractSymmetricProduct(const Matrix3<T>& H, const Matrix3<T>& W,
                              Matrix3<T>* M) {
  FillSymmetric(M, [&](int i, int j, T* entry) {
    Sum3<Into::kSubtract>(H(0, i), W(0, j), H(1, i), W(1, j), H(2, i), W(2, j),
                          entry);
  });
}

// Each column of m crossed from the left by r.
template <typename T>
void CrossColumns(const Vector3<T>& r, const Matrix3<T>& m, Matrix3<T>* out) {
  for (int j = 0; j < 3; ++j) {
    Difference2<Into::kSet>(r[1], m(2, j), r[2], m(1, j), &(*out)(0, j));
    Difference2<Into::kSet>(r[2], m(0, j), r[0], m(2, j), &(*out)(1, j));
    Difference2<Into::kSet>(r[0], m(1, j), r[1], m(0, j), &(*out)(2, j));
  }
}

// Inverse of a symmetric matrix by its adjugate; false where it is not positive
// definite.
template <typename T>
bool InvertSymmetric(const Matrix3<T>& S, Matrix3<T>* inverse) {
  T c00, c01, c02, c11, c12, c22, determinant;
  Difference2<Into::kSet>(S(1, 1), S(2, 2), S(2, 1), S(2, 1), &c00);
  Difference2<Into::kSet>(S(2, 0), S(2, 1), S(1, 0), S(2, 2), &c01);
  Difference2<Into::kSet>(S(1, 0), S(2, 1), S(2, 0), S(1, 1), &c02);
  Difference2<Into::kSet>(S(0, 0), S(2, 2), S(2, 0), S(2, 0), &c11);
  Difference2<Into::kSet>(S(1, 0), S(2, 0), S(0, 0), S(2, 1), &c12);
  Difference2<Into::kSet>(S(0, 0), S(1, 1), S(1, 0), S(1, 0), &c22);
  Sum3<Into::kSet>(S(0, 0), c00, S(1, 0), c01, S(2, 0), c02, &determinant);
  if (!(ValueOf(S(0, 0)) > 0.0) || !(ValueOf(c22) > 0.0) ||
      !(ValueOf(determinant) > 0.0)) {
    return false;
  }
  const T scale = T(1.0) / determinant;
  const T* adjugate[3][3] = {
      {&c00, &c01, &c02}, {&c01, &c11, &c12}, {&c02, &c12, &c22}};
  FillSymmetric(inverse, [&](int i, int j, T* entry) {
    Product<Into::kSet>(*adjugate[i][j], scale, entry);
  });
  return true;
}

}  // namespace internal
}  // namespace sysid
