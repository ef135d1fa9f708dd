#include <Eigen/QR>
#include <algorithm>

#include "models/math/decompositions.h"

namespace sysid {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd HouseholderTriangle(const MatrixXd& A) {
  if (A.rows() == 0) return A;
  const Eigen::HouseholderQR<MatrixXd> qr(A);
  return qr.matrixQR()
      .topRows(std::min(A.rows(), A.cols()))
      .triangularView<Eigen::Upper>();
}

HouseholderFactors::HouseholderFactors(const MatrixXd& A) {
  const Eigen::HouseholderQR<MatrixXd> qr(A);
  Q_ = qr.householderQ() * MatrixXd::Identity(A.rows(), A.cols());
  R_ = qr.matrixQR().topRows(A.cols()).triangularView<Eigen::Upper>();
}

VectorXd HouseholderFactors::Solve(const VectorXd& b) const {
  return R_.triangularView<Eigen::Upper>().solve(Q_.transpose() * b);
}

int RankOf(const MatrixXd& A) {
  return static_cast<int>(Eigen::ColPivHouseholderQR<MatrixXd>(A).rank());
}

VectorXd LeastSquares(const MatrixXd& A, const VectorXd& b, int* rank) {
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
  if (rank != nullptr) *rank = static_cast<int>(qr.rank());
  return qr.solve(b);
}

VectorXd ShortestLeastSquares(const MatrixXd& A, const VectorXd& b,
                              double threshold, int* rank) {
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> qr;
  if (threshold >= 0.0) qr.setThreshold(threshold);
  qr.compute(A);
  if (rank != nullptr) *rank = static_cast<int>(qr.rank());
  return qr.solve(b);
}

MatrixXd SolveSquare(const MatrixXd& A, const MatrixXd& B) {
  return Eigen::FullPivHouseholderQR<MatrixXd>(A).solve(B);
}

}  // namespace sysid
