#include "sysid/unexplained_force/block_tridiagonal.h"

#include <gmock/gmock.h>

#include <cmath>

namespace sysid {
namespace {

using Eigen::MatrixXd;

// Sums of products over windows that fit into two neighbouring blocks, as
// segments give them, and the whole matrix beside it.
struct Windows {
  Windows() : blocks(BlockTridiagonal::Zero({0, 3, 5, 9, 12})), dense(12, 12) {
    dense.setIdentity();
    for (int i = 0; i < 12; ++i) blocks.At(i, i) += 1.0;
    std::srand(3);
    const int starts[] = {0, 1, 3, 4, 6, 9}, sizes[] = {5, 4, 6, 3, 6, 3};
    for (int w = 0; w < 6; ++w) {
      const MatrixXd A = MatrixXd::Random(4, sizes[w]);
      const MatrixXd part = A.transpose() * A;
      blocks.Add(starts[w], part);
      dense.block(starts[w], starts[w], sizes[w], sizes[w]) += part;
    }
  }
  BlockTridiagonal blocks;
  MatrixXd dense;
};

TEST(BlockTridiagonal, HoldsWhatWasAdded) {
  const Windows both;
  for (int i = 0; i < 12; ++i) {
    for (int j = 0; j < 12; ++j) {
      const int apart = both.blocks.BlockOf(i) - both.blocks.BlockOf(j);
      if (std::abs(apart) > 1) {
        EXPECT_EQ(both.dense(i, j), 0.0);
      } else {
        EXPECT_DOUBLE_EQ(both.blocks.At(i, j), both.dense(i, j));
      }
    }
  }
  const MatrixXd x = MatrixXd::Random(12, 2);
  EXPECT_LT((both.blocks.Times(x) - both.dense * x).norm(), 1e-12);
}

TEST(BlockCholesky, IsThatOfTheWholeMatrix) {
  const Windows both;
  const BlockCholesky factor(both.blocks);
  ASSERT_TRUE(factor.Valid());
  EXPECT_NEAR(factor.LogDeterminant(), std::log(both.dense.determinant()),
              1e-10);
  const MatrixXd b = MatrixXd::Random(12, 3);
  EXPECT_LT((both.dense * factor.Solve(b) - b).norm(), 1e-12);
  const MatrixXd whole = both.dense.inverse();
  const BlockTridiagonal inverse = factor.Inverse();
  for (int i = 0; i < 12; ++i) {
    for (int j = 0; j < 12; ++j) {
      if (std::abs(inverse.BlockOf(i) - inverse.BlockOf(j)) > 1) continue;
      EXPECT_NEAR(inverse.At(i, j), whole(i, j), 1e-12) << i << ", " << j;
    }
  }
}

TEST(BlockCholesky, RefusesWhatIsNotPositive) {
  Windows both;
  both.blocks.At(7, 7) = -1.0;
  EXPECT_FALSE(BlockCholesky(both.blocks).Valid());
}

}  // namespace
}  // namespace sysid
