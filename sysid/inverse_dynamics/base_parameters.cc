#include "sysid/inverse_dynamics/base_parameters.h"

#include <Eigen/QR>
#include <cmath>

namespace sysid {
namespace {

// Of columns of length 1: what is left of one that depends on others.
constexpr double kDependent = 1e-6;
// A coordinate's share in a combination, both in their own sizes, that is
// rounding.
constexpr double kShare = 1e-6;

}  // namespace

std::vector<BaseParameter> BaseParameters(
    const EquationCoordinates& coordinates, const RowMatrixXd& R,
    const Eigen::VectorXd& xi) {
  const int n = coordinates.size(), rows = static_cast<int>(R.rows());
  const Eigen::VectorXd size = R.leftCols(n).colwise().norm().transpose();
  const double nothing = 1e-10 * size.maxCoeff();
  // An orthonormal basis Q of the columns that are kept, and their triangle.
  Eigen::MatrixXd Q(rows, n), T = Eigen::MatrixXd::Zero(n, n);
  std::vector<int> kept;
  std::vector<std::pair<int, Eigen::VectorXd>> dependent;  // b, unit columns
  for (int c = 0; c < n; ++c) {
    if (!(size[c] > nothing)) continue;
    const int k = static_cast<int>(kept.size());
    Eigen::VectorXd left = R.col(c) / size[c];
    Eigen::VectorXd along = Eigen::VectorXd::Zero(k);
    for (int again = 0; again < 2; ++again) {  // against rounding
      const Eigen::VectorXd more = Q.leftCols(k).transpose() * left;
      left -= Q.leftCols(k) * more;
      along += more;
    }
    const double norm = left.norm();
    if (norm < kDependent) {
      dependent.emplace_back(
          c, T.topLeftCorner(k, k).triangularView<Eigen::Upper>().solve(along));
    } else {
      T.col(k).head(k) = along;
      T(k, k) = norm;
      Q.col(k) = left / norm;
      kept.push_back(c);
    }
  }
  const int rank = static_cast<int>(kept.size());
  const Eigen::MatrixXd inverse =
      T.topLeftCorner(rank, rank)
          .triangularView<Eigen::Upper>()
          .solve(Eigen::MatrixXd::Identity(rank, rank));
  std::vector<BaseParameter> out;
  for (int i = 0; i < rank; ++i) {
    const int c = kept[i];
    BaseParameter base;
    base.unit = coordinates.Unit(c);
    base.terms.push_back({coordinates.Name(c), 1.0});
    base.value = xi[c];
    for (const auto& [other, b] : dependent) {
      if (i >= b.size() || std::abs(b[i]) < kShare) continue;
      const double share = b[i] * size[other] / size[c];
      base.terms.push_back({coordinates.Name(other), share});
      base.value += share * xi[other];
    }
    base.std_error = inverse.row(i).norm() / size[c];
    out.push_back(std::move(base));
  }
  return out;
}

}  // namespace sysid
