#pragma once

#include <vector>

#include "models/math/decompositions.h"
#include "models/math/types.h"

namespace sysid {

// A symmetric matrix of blocks on its diagonal and beside it, as chains in time
// have: `below[i]` stands at row i + 1, column i.
struct BlockTridiagonal {
  std::vector<int> first;  // first row of each block, and the size
  std::vector<Eigen::MatrixXd> diagonal, below;

  // Zeros, of blocks that start at `first[i]`; the last entry is the size.
  static BlockTridiagonal Zero(const std::vector<int>& first);

  int blocks() const { return static_cast<int>(diagonal.size()); }
  int size() const { return first.back(); }
  int BlockOf(int row) const;
  // The entry (row, column), which must be in a block; of the two triangles of
  // a matrix only row >= column is kept beside the diagonal.
  double& At(int row, int column);
  double At(int row, int column) const {
    return const_cast<BlockTridiagonal*>(this)->At(row, column);
  }
  // Adds a symmetric matrix at (row, row); it must fit into two neighbours.
  void Add(int row, const Eigen::MatrixXd& part);
  Eigen::MatrixXd Times(const Eigen::MatrixXd& x) const;
};

// Cholesky's factor of one that is positive definite, in time that grows with
// the number of blocks.
class BlockCholesky {
 public:
  explicit BlockCholesky(const BlockTridiagonal& matrix);
  bool Valid() const { return valid_; }
  double LogDeterminant() const;
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& b) const;
  // Of the inverse, the blocks that the matrix has (Takahashi's recursion).
  BlockTridiagonal Inverse() const;

 private:
  std::vector<int> first_;
  bool valid_ = true;
  std::vector<Cholesky> chol_;
  std::vector<Eigen::MatrixXd> below_;  // W_i = below_i L_i^-T
};

}  // namespace sysid
