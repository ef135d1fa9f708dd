#pragma once

#include <Eigen/Core>

namespace sysid {

// Dense decompositions of real matrices, by Eigen. Plain functions, so that
// Eigen's templates, which take seconds of a compiler's time each, are compiled
// once and no other file includes <Eigen/QR>, <Eigen/SVD>, <Eigen/Eigenvalues>
// or <Eigen/Cholesky> (matrices of a fixed size apart).

// --- Orthogonal triangles ---------------------------------------------------

// The first min(m, n) rows of R of A = Q R (A is m x n), by Householder's
// reflections; zeros below the diagonal.
Eigen::MatrixXd HouseholderTriangle(const Eigen::MatrixXd& A);

// A = Q R with Q m x n and R n x n, for m >= n. Solves least |A x - b|.
class HouseholderFactors {
 public:
  explicit HouseholderFactors(const Eigen::MatrixXd& A);
  const Eigen::MatrixXd& Q() const { return Q_; }
  const Eigen::MatrixXd& R() const { return R_; }
  Eigen::VectorXd Solve(const Eigen::VectorXd& b) const;

 private:
  Eigen::MatrixXd Q_, R_;
};

// --- Least squares ----------------------------------------------------------

// How many columns of A are independent: pivots beyond rounding (pivoted QR).
int RankOf(const Eigen::MatrixXd& A);

// The x of least |A x - b| by pivoted QR; dependent columns get zero.
// `rank`, if given, becomes that of A.
Eigen::VectorXd LeastSquares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                             int* rank = nullptr);

// The shortest x of least |A x - b| (complete orthogonal decomposition). A
// pivot below `threshold` times the largest is taken for zero; a negative one
// means Eigen's, which is rounding.
Eigen::VectorXd ShortestLeastSquares(const Eigen::MatrixXd& A,
                                     const Eigen::VectorXd& b,
                                     double threshold = -1.0,
                                     int* rank = nullptr);

// X of A X = B for a square A, by QR with both pivots: the most careful.
Eigen::MatrixXd SolveSquare(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

Eigen::MatrixXd InverseOf(const Eigen::MatrixXd& A);  // square; by LU

// --- Symmetric and positive -------------------------------------------------

// A = L L'. Only the lower triangle of A is read.
class Cholesky {
 public:
  Cholesky() = default;
  explicit Cholesky(const Eigen::MatrixXd& A);
  bool Valid() const { return valid_; }  // false: A is not positive definite
  const Eigen::MatrixXd& L() const { return L_; }  // zeros above the diagonal
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& B) const;
  Eigen::VectorXd Solve(const Eigen::VectorXd& b) const;
  // X becomes L^-1 X, L^-T X, X L^-1, X L^-T.
  void SolveL(Eigen::Ref<Eigen::MatrixXd> X) const;
  void SolveLTransposed(Eigen::Ref<Eigen::MatrixXd> X) const;
  void SolveLRight(Eigen::Ref<Eigen::MatrixXd> X) const;
  void SolveLTransposedRight(Eigen::Ref<Eigen::MatrixXd> X) const;
  double LogDeterminant() const;  // of A

 private:
  bool valid_ = false;
  Eigen::MatrixXd L_;
};

// X of A X = B for a symmetric A that may be semidefinite (pivoted L D L').
Eigen::MatrixXd SolveSymmetric(const Eigen::MatrixXd& A,
                               const Eigen::MatrixXd& B);
Eigen::VectorXd SolveSymmetric(const Eigen::MatrixXd& A,
                               const Eigen::VectorXd& b);

// --- Eigenvalues and singular values ----------------------------------------

// S V = V diag(values), V orthonormal, values ascending.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
SymmetricEigen EigenOfSymmetric(const Eigen::MatrixXd& S);
SymmetricEigen EigenOfTridiagonal(const Eigen::VectorXd& diagonal,
                                  const Eigen::VectorXd& beside);
// S = F F', negative eigenvalues taken for the rounding of zero.
Eigen::MatrixXd RootOfCovariance(const Eigen::MatrixXd& S);

// Of any square matrix; empty where the iteration does not converge.
Eigen::VectorXcd EigenvaluesOf(const Eigen::MatrixXd& A);

// A = U diag(s) V', s descending; U m x min(m, n), V n x min(m, n), or n x n
// where `full_v`. By Jacobi's rotations: small values are as accurate as large
// ones.
struct SingularValues {
  Eigen::MatrixXd U;
  Eigen::VectorXd s;
  Eigen::MatrixXd V;
};
SingularValues SingularValuesOf(const Eigen::MatrixXd& A, bool full_v = false);

}  // namespace sysid
