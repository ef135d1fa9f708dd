#include "sysid/estimation/identifiability.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace sysid {
namespace {

// Disjoint sets of parameters that some undetermined direction joins.
class Groups {
 public:
  explicit Groups(int n) : parent_(n) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int Find(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void Join(int a, int b) { parent_[Find(a)] = Find(b); }

 private:
  std::vector<int> parent_;
};

// A basis of the space spanned by the columns of N in which each direction has
// as few parameters as it can: reduced row echelon form with full pivoting, so
// that independent groups do not mix.
Eigen::MatrixXd SparseBasis(Eigen::MatrixXd N) {
  const int k = static_cast<int>(N.cols());
  std::vector<bool> used(N.rows(), false);
  for (int c = 0; c < k; ++c) {
    int pivot_row = 0, pivot_column = c;
    double best = -1.0;
    for (int j = c; j < k; ++j) {
      for (int i = 0; i < N.rows(); ++i) {
        if (!used[i] && std::abs(N(i, j)) > best) {
          best = std::abs(N(i, j));
          pivot_row = i;
          pivot_column = j;
        }
      }
    }
    if (best < 1e-12) break;
    N.col(c).swap(N.col(pivot_column));
    N.col(c) /= N(pivot_row, c);
    used[pivot_row] = true;
    for (int j = 0; j < k; ++j) {
      if (j != c) N.col(j) -= N(pivot_row, j) * N.col(c);
    }
  }
  return N;
}

}  // namespace

Identifiability AnalyseIdentifiability(const RowMatrixXd& R,
                                       const Eigen::VectorXd& scale) {
  const int n = static_cast<int>(R.cols());
  Identifiability result;
  result.identifiable.assign(n, true);
  result.covariance.setZero(n, n);
  if (n == 0) return result;
  const Eigen::MatrixXd scaled = R * scale.asDiagonal();
  const double largest = scaled.colwise().norm().maxCoeff();
  for (int i = 0; i < n; ++i) {
    if (!(scaled.col(i).norm() > 1e-10 * std::max(largest, 1.0))) {
      result.without_influence.push_back(i);
    }
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled, Eigen::ComputeFullV);
  const Eigen::VectorXd s = svd.singularValues();
  const double rounding = 1e-13 * s[0];
  std::vector<int> undetermined;
  for (int k = 0; k < n; ++k) {
    if (s[k] * kUndetermined < 1.0 || s[k] < rounding) {
      undetermined.push_back(k);
    } else {
      const Eigen::VectorXd v = scale.asDiagonal() * svd.matrixV().col(k);
      result.covariance += v * v.transpose() / (s[k] * s[k]);
    }
  }
  result.undetermined.resize(n, undetermined.size());
  for (size_t k = 0; k < undetermined.size(); ++k) {
    constexpr double kMost = 1e6;
    const double length =
        std::min(kMost, 1.0 / std::max(s[undetermined[k]], 1.0 / kMost));
    result.undetermined.col(k) =
        length * (scale.asDiagonal() * svd.matrixV().col(undetermined[k]));
  }
  if (undetermined.empty()) return result;
  Eigen::MatrixXd N(n, undetermined.size());
  for (size_t k = 0; k < undetermined.size(); ++k) {
    N.col(k) = svd.matrixV().col(undetermined[k]);
  }
  N = SparseBasis(N);
  Groups groups(n);
  for (int k = 0; k < N.cols(); ++k) {
    const double most = N.col(k).cwiseAbs().maxCoeff();
    int first = -1;
    for (int i = 0; i < n; ++i) {
      if (std::abs(N(i, k)) < 0.1 * most) continue;
      result.identifiable[i] = false;
      if (first >= 0) groups.Join(i, first);
      first = i;
    }
  }
  std::vector<int> root_of;
  for (int i = 0; i < n; ++i) {
    if (result.identifiable[i]) continue;
    const int root = groups.Find(i);
    const auto at = std::find(root_of.begin(), root_of.end(), root);
    if (at == root_of.end()) {
      root_of.push_back(root);
      result.groups.push_back({i});
    } else {
      result.groups[at - root_of.begin()].push_back(i);
    }
  }
  return result;
}

}  // namespace sysid
