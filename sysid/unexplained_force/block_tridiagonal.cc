#include "sysid/unexplained_force/block_tridiagonal.h"

#include <algorithm>
#include <cmath>

namespace sysid {

using Eigen::MatrixXd;

BlockTridiagonal BlockTridiagonal::Zero(const std::vector<int>& first) {
  BlockTridiagonal zero;
  zero.first = first;
  for (size_t i = 0; i + 1 < first.size(); ++i) {
    const int size = first[i + 1] - first[i];
    zero.diagonal.push_back(MatrixXd::Zero(size, size));
    if (i + 2 < first.size()) {
      zero.below.push_back(MatrixXd::Zero(first[i + 2] - first[i + 1], size));
    }
  }
  return zero;
}

int BlockTridiagonal::BlockOf(int row) const {
  const auto after = std::upper_bound(first.begin(), first.end() - 1, row);
  return static_cast<int>(after - first.begin()) - 1;
}

double& BlockTridiagonal::At(int row, int column) {
  if (row < column) std::swap(row, column);
  const int i = BlockOf(row), j = BlockOf(column);
  Eigen::MatrixXd& block = i == j ? diagonal[i] : below[j];
  return block(row - first[i], column - first[j]);
}

void BlockTridiagonal::Add(int row, const MatrixXd& part) {
  const int i = BlockOf(row);
  const int at = row - first[i];
  const int size = static_cast<int>(part.rows());
  const int here = std::min(size, first[i + 1] - row), next = size - here;
  diagonal[i].block(at, at, here, here) += part.topLeftCorner(here, here);
  if (next == 0) return;
  below[i].block(0, at, next, here) += part.bottomLeftCorner(next, here);
  diagonal[i + 1].topLeftCorner(next, next) +=
      part.bottomRightCorner(next, next);
}

MatrixXd BlockTridiagonal::Times(const MatrixXd& x) const {
  MatrixXd out = MatrixXd::Zero(x.rows(), x.cols());
  const auto rows = [&](auto& all, int i) {
    return all.middleRows(first[i], first[i + 1] - first[i]);
  };
  for (int i = 0; i < blocks(); ++i) {
    rows(out, i).noalias() += diagonal[i] * rows(x, i);
    if (i + 1 == blocks()) break;
    rows(out, i + 1).noalias() += below[i] * rows(x, i);
    rows(out, i).noalias() += below[i].transpose() * rows(x, i + 1);
  }
  return out;
}

BlockCholesky::BlockCholesky(const BlockTridiagonal& matrix)
    : first_(matrix.first), chol_(matrix.blocks()), below_(matrix.below) {
  for (int i = 0; i < matrix.blocks(); ++i) {
    MatrixXd left = matrix.diagonal[i];
    if (i > 0) left.noalias() -= below_[i - 1] * below_[i - 1].transpose();
    chol_[i] = Cholesky(left);
    if (!chol_[i].Valid()) {
      valid_ = false;
      return;
    }
    if (i + 1 < matrix.blocks()) {
      chol_[i].SolveLTransposedRight(below_[i]);
    }
  }
}

double BlockCholesky::LogDeterminant() const {
  double sum = 0.0;
  for (const Cholesky& chol : chol_) sum += chol.LogDeterminant();
  return sum;
}

MatrixXd BlockCholesky::Solve(const MatrixXd& b) const {
  MatrixXd x = b;
  if (x.size() == 0) return x;
  const int blocks = static_cast<int>(chol_.size());
  const auto rows = [&](int i) {
    return x.middleRows(first_[i], first_[i + 1] - first_[i]);
  };
  for (int i = 0; i < blocks; ++i) {
    auto here = rows(i);
    if (i > 0) here.noalias() -= below_[i - 1] * rows(i - 1);
    chol_[i].SolveL(here);
  }
  for (int i = blocks - 1; i >= 0; --i) {
    auto here = rows(i);
    if (i + 1 < blocks) here.noalias() -= below_[i].transpose() * rows(i + 1);
    chol_[i].SolveLTransposed(here);
  }
  return x;
}

BlockTridiagonal BlockCholesky::Inverse() const {
  BlockTridiagonal inverse = BlockTridiagonal::Zero(first_);
  for (int i = inverse.blocks() - 1; i >= 0; --i) {
    const int size = first_[i + 1] - first_[i];
    inverse.diagonal[i] =
        chol_[i].Solve(MatrixXd(MatrixXd::Identity(size, size)));
    if (i + 1 == inverse.blocks()) continue;
    MatrixXd M = below_[i];  // W_i L_i^-1
    chol_[i].SolveLRight(M);
    inverse.below[i].noalias() = -inverse.diagonal[i + 1] * M;
    inverse.diagonal[i].noalias() -= M.transpose() * inverse.below[i];
  }
  return inverse;
}

}  // namespace sysid
