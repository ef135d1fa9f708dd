#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "models/math/decompositions.h"

namespace sysid {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd InverseOf(const MatrixXd& A) { return A.inverse(); }

Cholesky::Cholesky(const MatrixXd& A) {
  const Eigen::LLT<MatrixXd> llt(A);
  valid_ = llt.info() == Eigen::Success;
  L_ = llt.matrixL();
}

MatrixXd Cholesky::Solve(const MatrixXd& B) const {
  MatrixXd X = B;
  SolveL(X);
  SolveLTransposed(X);
  return X;
}

VectorXd Cholesky::Solve(const VectorXd& b) const {
  VectorXd x = b;
  L_.triangularView<Eigen::Lower>().solveInPlace(x);
  L_.transpose().triangularView<Eigen::Upper>().solveInPlace(x);
  return x;
}

void Cholesky::SolveL(Eigen::Ref<MatrixXd> X) const {
  L_.triangularView<Eigen::Lower>().solveInPlace(X);
}

void Cholesky::SolveLTransposed(Eigen::Ref<MatrixXd> X) const {
  L_.transpose().triangularView<Eigen::Upper>().solveInPlace(X);
}

void Cholesky::SolveLRight(Eigen::Ref<MatrixXd> X) const {
  L_.triangularView<Eigen::Lower>().solveInPlace<Eigen::OnTheRight>(X);
}

void Cholesky::SolveLTransposedRight(Eigen::Ref<MatrixXd> X) const {
  L_.transpose().triangularView<Eigen::Upper>().solveInPlace<Eigen::OnTheRight>(
      X);
}

double Cholesky::LogDeterminant() const {
  return 2.0 * L_.diagonal().array().log().sum();
}

MatrixXd SolveSymmetric(const MatrixXd& A, const MatrixXd& B) {
  return A.ldlt().solve(B);
}

VectorXd SolveSymmetric(const MatrixXd& A, const VectorXd& b) {
  return A.ldlt().solve(b);
}

}  // namespace sysid
