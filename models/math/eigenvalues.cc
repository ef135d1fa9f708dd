#include <Eigen/Eigenvalues>

#include "models/math/decompositions.h"

namespace sysid {

using Eigen::MatrixXd;
using Eigen::VectorXd;

SymmetricEigen EigenOfSymmetric(const MatrixXd& S) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(S);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

SymmetricEigen EigenOfTridiagonal(const VectorXd& diagonal,
                                  const VectorXd& beside) {
  Eigen::SelfAdjointEigenSolver<MatrixXd> solver;
  solver.computeFromTridiagonal(diagonal, beside);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

MatrixXd RootOfCovariance(const MatrixXd& S) {
  const SymmetricEigen eigen = EigenOfSymmetric(S);
  return eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

Eigen::VectorXcd EigenvaluesOf(const MatrixXd& A) {
  const Eigen::EigenSolver<MatrixXd> solver(A, false);
  if (solver.info() != Eigen::Success) return {};
  return solver.eigenvalues();
}

}  // namespace sysid
