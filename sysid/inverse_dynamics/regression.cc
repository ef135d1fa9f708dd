#include "sysid/inverse_dynamics/regression.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace sysid {
namespace {

// Columns of length 1 that others give to this part are dependent: rounding of
// a motion that is known to 1e-6 of itself.
constexpr double kDependent = 1e-6;
// A column of less beside the longest says nothing.
constexpr double kNothing = 1e-10;

// The triangle of rows (square, zeros where there are fewer rows).
RowMatrixXd TriangleOf(const RowMatrixXd& rows) {
  const int n = static_cast<int>(rows.cols());
  RowMatrixXd triangle = RowMatrixXd::Zero(n, n);
  if (rows.rows() == 0) return triangle;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(rows);
  const int filled = std::min<int>(n, rows.rows());
  triangle.topRows(filled) =
      qr.matrixQR().topRows(filled).triangularView<Eigen::Upper>();
  return triangle;
}

}  // namespace

EquationRegression::EquationRegression(std::vector<EquationRows> runs,
                                       RobustLoss loss, double loss_scale)
    : runs_(std::move(runs)), loss_(loss), loss_scale_(loss_scale) {
  joints_ = runs_.front().nv;
  columns_ = static_cast<int>(runs_.front().rows.cols()) - 1;
  for (const EquationRows& run : runs_) {
    weights_.push_back(Eigen::VectorXd::Ones(run.rows.rows()));
  }
  LeaveOutRests();
  sigma_ = EffortSize();
  const double most = sigma_.maxCoeff();
  for (double& s : sigma_) s = s > 1e-9 * most ? s : most > 0 ? most : 1.0;
  Triangularise();
}

void EquationRegression::LeaveOutRests() {
  times_.setZero(joints_);
  for (EquationRows& run : runs_) {
    times_ += run.tells.colwise().sum().transpose();
    run.effort.array() *= run.tells.array();
    for (int i = 0; i < run.rows.rows(); ++i) {
      if (run.tells(i / joints_, i % joints_) == 0.0) run.rows.row(i).setZero();
    }
  }
  times_ = times_.cwiseMax(1.0);
}

void EquationRegression::Triangularise() {
  triangles_.assign(joints_, {});
  for (int v = 0; v < joints_; ++v) {
    int times = 0;
    for (const EquationRows& run : runs_) times += run.times();
    RowMatrixXd rows(times, columns_ + 1);
    int at = 0;
    for (size_t r = 0; r < runs_.size(); ++r) {
      for (int k = 0; k < runs_[r].times(); ++k) {
        const int row = k * joints_ + v;
        rows.row(at++) = weights_[r][row] * runs_[r].rows.row(row);
      }
    }
    triangles_[v] = TriangleOf(rows);
  }
}

RowMatrixXd EquationRegression::Merge(const Eigen::VectorXd& sigma) const {
  const int held = held_.size() > 0 ? 1 : 0;
  RowMatrixXd all(joints_ * (columns_ + 1) + held, columns_ + 1);
  if (held > 0) all.bottomRows(1) << held_, 0.0;
  for (int v = 0; v < joints_; ++v) {
    all.middleRows(v * (columns_ + 1), columns_ + 1) = triangles_[v] / sigma[v];
  }
  return TriangleOf(all);
}

bool EquationRegression::IsHomogeneous(const Eigen::VectorXd& xi0) const {
  constexpr double kRounding = 1e-9;
  const RowMatrixXd all = Merge(sigma_);
  const Eigen::VectorXd z = all.col(columns_);
  return z.norm() > 0.0 &&
         (z - all.leftCols(columns_) * xi0).norm() < kRounding * z.norm();
}

void EquationRegression::Normalise(const EquationRegression& inertial,
                                   const Eigen::VectorXd& xi0) {
  for (int v = 0; v < joints_; ++v) {
    const RowMatrixXd& triangle = inertial.triangles_[v];
    const Eigen::VectorXd p = triangle.leftCols(columns_) * xi0;
    if (!(p.squaredNorm() > 0.0)) continue;
    const Eigen::RowVectorXd a =
        p.transpose() * triangle.leftCols(columns_) / p.squaredNorm();
    for (EquationRows& run : runs_) {
      for (int k = 0; k < run.times(); ++k) {
        auto row = run.rows.row(k * joints_ + v);
        row.head(columns_) -= row[columns_] * a;
      }
    }
  }
  Triangularise();
}

void EquationRegression::HoldScale(const EquationRegression& inertial,
                                   const Eigen::VectorXd& xi0) {
  const RowMatrixXd triangle = inertial.Triangle();
  const Eigen::RowVectorXd a = (triangle.leftCols(columns_) * xi0).transpose() *
                               triangle.leftCols(columns_);
  // What is left is 1 a row: beside that a scale that is off by 1 % is much.
  constexpr double kFirm = 10.0;
  double rows = 0.0;
  for (const EquationRows& run : runs_) rows += run.rows.rows();
  held_ = kFirm * std::sqrt(rows) / a.dot(xi0) * a;
}

RowMatrixXd EquationRegression::Triangle() const {
  return Merge(sigma_).topRows(columns_);
}

Eigen::VectorXd EquationRegression::Left(const Eigen::VectorXd& d) const {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(joints_);
  for (const EquationRows& run : runs_) {
    const Eigen::VectorXd left =
        run.rows.leftCols(columns_) * d + run.rows.col(columns_);
    for (int k = 0; k < run.times(); ++k) {
      squares += left.segment(k * joints_, joints_).cwiseAbs2();
    }
  }
  return squares.cwiseQuotient(times_).cwiseSqrt();
}

Eigen::VectorXd EquationRegression::EffortSize() const {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(joints_);
  for (const EquationRows& run : runs_) {
    squares += run.effort.colwise().squaredNorm().transpose();
  }
  return squares.cwiseQuotient(times_).cwiseSqrt();
}

void EquationRegression::Reweigh(const Eigen::VectorXd& d) {
  const Eigen::VectorXd left = Left(d);
  // What is left of a joint that nothing moves is rounding, and no weight.
  const double least = 1e-9 * left.maxCoeff();
  for (int v = 0; v < joints_; ++v) sigma_[v] = std::max(left[v], least);
  if (!(sigma_.minCoeff() > 0.0)) sigma_.setOnes();
  if (loss_ == RobustLoss::kNone) return;
  for (size_t r = 0; r < runs_.size(); ++r) {
    const EquationRows& run = runs_[r];
    const Eigen::VectorXd errors =
        run.rows.leftCols(columns_) * d + run.rows.col(columns_);
    for (int i = 0; i < errors.size(); ++i) {
      const double s = errors[i] / sigma_[i % joints_];
      double rho, rho_prime;
      EvaluateLoss(loss_, loss_scale_, s * s, &rho, &rho_prime);
      weights_[r][i] = std::sqrt(rho_prime);
    }
  }
  Triangularise();
}

RowMatrixXd EquationRegression::ErrorRoot(const Eigen::VectorXd& d) const {
  const RowMatrixXd R = Triangle().leftCols(columns_);
  // The columns as the data determines them, of unit information: R P = U.
  Eigen::VectorXd scale = R.colwise().norm().transpose();
  for (double& s : scale) s = s > 0.0 ? 1.0 / s : 0.0;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(
      R * scale.asDiagonal(), Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd& size = svd.singularValues();
  int rank = 0;
  while (rank < size.size() && size[rank] > kDependent * size[0]) ++rank;
  const Eigen::MatrixXd P = scale.asDiagonal() * svd.matrixV().leftCols(rank) *
                            size.head(rank).cwiseInverse().asDiagonal();
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(rank, rank);
  for (size_t r = 0; r < runs_.size(); ++r) {
    const EquationRows& run = runs_[r];
    const int n = run.times();
    RowMatrixXd scores = RowMatrixXd::Zero(n, rank);
    for (int k = 0; k < n; ++k) {
      Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(columns_);
      for (int v = 0; v < joints_; ++v) {
        const int row = k * joints_ + v;
        const auto columns = run.rows.row(row).head(columns_);
        const double weight = weights_[r][row] / sigma_[v];
        const double left = columns.dot(d) + run.rows(row, columns_);
        sum += weight * weight * left * columns;
      }
      scores.row(k).noalias() = sum * P;
    }
    // Bartlett's window over a lag that grows as the cube root of n (Newey and
    // West 1994 give 4 (n / 100)^(2/9) for white scores; what a model misses is
    // correlated over longer).
    const int lags = std::min(n - 1, static_cast<int>(2.0 * std::cbrt(n)));
    S.noalias() += scores.transpose() * scores;
    for (int lag = 1; lag <= lags; ++lag) {
      const Eigen::MatrixXd moved =
          (1.0 - lag / (lags + 1.0)) *
          (scores.topRows(n - lag).transpose() * scores.bottomRows(n - lag));
      S += moved + moved.transpose();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(S);
  // Few times do not show all of S.
  constexpr double kLeast = 0.05;
  return svd.matrixU().leftCols(rank) * eigen.eigenvectors() *
         eigen.eigenvalues().cwiseMax(kLeast).cwiseSqrt().asDiagonal();
}

Eigen::VectorXd SolveUnconstrained(const RowMatrixXd& triangle, int* rank) {
  const int n = static_cast<int>(triangle.cols()) - 1;
  Eigen::VectorXd scale = triangle.leftCols(n).colwise().norm().transpose();
  const double nothing = kNothing * (n > 0 ? scale.maxCoeff() : 0.0);
  for (double& s : scale) s = s > nothing ? 1.0 / s : 0.0;
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> qr;
  qr.setThreshold(kDependent);
  qr.compute(triangle.leftCols(n) * scale.asDiagonal());
  if (rank != nullptr) *rank = static_cast<int>(qr.rank());
  return -scale.cwiseProduct(qr.solve(triangle.col(n)));
}

}  // namespace sysid
