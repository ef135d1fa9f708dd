#include "sysid/inverse_dynamics/base_parameters.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "models/math/decompositions.h"

namespace sysid {
namespace {

// Of columns of length 1: what is left of one that depends on others.
constexpr double kDependentColumn = 1e-6;
// A coordinate's share in a combination, both in their own sizes, that is
// rounding.
constexpr double kShare = 1e-6;

// Groups of the indices that `joined` joins.
std::vector<std::vector<int>> ConnectedGroups(const std::vector<int>& indices,
                                              const Eigen::MatrixXd& joined,
                                              double least) {
  std::vector<std::vector<int>> groups;
  std::set<int> left(indices.begin(), indices.end());
  while (!left.empty()) {
    std::vector<int> group = {*left.begin()};
    left.erase(left.begin());
    for (size_t at = 0; at < group.size(); ++at) {
      for (auto it = left.begin(); it != left.end();) {
        if (std::abs(joined(group[at], *it)) > least) {
          group.push_back(*it);
          it = left.erase(it);
        } else {
          ++it;
        }
      }
    }
    std::sort(group.begin(), group.end());
    groups.push_back(std::move(group));
  }
  return groups;
}

}  // namespace

std::vector<BaseParameter> BaseParameters(
    const EquationCoordinates& coordinates, const RowMatrixXd& R,
    const RowMatrixXd& E, const Eigen::VectorXd& xi) {
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
    if (norm < kDependentColumn) {
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
  const Eigen::MatrixXd errors = T.topLeftCorner(rank, rank)
                                     .triangularView<Eigen::Upper>()
                                     .solve(Q.leftCols(rank).transpose() * E);
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
    base.std_error = errors.row(i).norm() / size[c];
    out.push_back(std::move(base));
  }
  return out;
}

Estimates EstimatesByRank(const ShootingProblem& problem,
                          const Eigen::VectorXd& theta, const RowMatrixXd& A,
                          const RowMatrixXd& E) {
  // Shares of a parameter's own change, which is rounding below.
  constexpr double kMoves = 1e-3;
  Estimates estimates;
  const int p = problem.map().size();
  Eigen::VectorXd values(p);
  problem.map().ValuesOf<double>(theta.data(), values.data());
  Eigen::VectorXd scale = A.colwise().norm().transpose();
  const double nothing = 1e-10 * (p > 0 ? scale.maxCoeff() : 0.0);
  for (double& s : scale) s = s > nothing ? 1.0 / s : 1.0;
  const SingularValues svd =
      SingularValuesOf(A * scale.asDiagonal(), /*full_v=*/true);
  const Eigen::VectorXd& size = svd.s;
  int rank = 0;
  while (rank < size.size() && size[rank] > kDependentColumn * size[0]) ++rank;
  const Eigen::MatrixXd D =
      problem.map().ValueJacobian(theta) * scale.asDiagonal();
  // Of theta / scale.
  const Eigen::MatrixXd root = svd.V.leftCols(rank) *
                               size.head(rank).cwiseInverse().asDiagonal() *
                               svd.U.leftCols(rank).transpose() * E;
  const Eigen::MatrixXd known = D * root;
  const Eigen::MatrixXd unseen = svd.V.rightCols(p - rank);
  const Eigen::MatrixXd moved = D * unseen;
  estimates.covariance = known * known.transpose();
  constexpr double kUnknown = 1e6;  // of their own sizes
  estimates.undetermined = kUnknown * moved;
  estimates.theta_covariance =
      scale.asDiagonal() * (root * root.transpose()) * scale.asDiagonal();
  std::vector<int> open;
  for (int i = 0; i < p; ++i) {
    const bool identifiable = moved.row(i).norm() < kMoves * D.row(i).norm();
    if (!identifiable) open.push_back(i);
    estimates.parameters.push_back(MakeEstimate(
        problem.free()[i], values[i], known.row(i).norm(), identifiable));
  }
  for (const std::vector<int>& group :
       ConnectedGroups(open, unseen * unseen.transpose(), kMoves)) {
    std::vector<std::string> names;
    for (const int i : group) names.push_back(estimates.parameters[i].name);
    estimates.not_identifiable.push_back(std::move(names));
  }
  return estimates;
}

}  // namespace sysid
