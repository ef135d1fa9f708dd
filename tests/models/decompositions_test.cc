#include "models/math/decompositions.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of rank 2: the third column is the sum of the others.
MatrixXd Tall() {
  MatrixXd A(4, 3);
  A << 1, 2, 3, -1, 0.5, -0.5, 0.3, 1, 1.3, 2, -2, 0;
  return A;
}

TEST(Decompositions, FindRanksAndShortestSolutions) {
  EXPECT_EQ(RankOf(Tall()), 2);
  EXPECT_EQ(RankOf(Tall().leftCols(2)), 2);
  const VectorXd b = Tall() * VectorXd::Ones(3);
  int rank = 0;
  const VectorXd x = ShortestLeastSquares(Tall(), b, -1.0, &rank);
  EXPECT_EQ(rank, 2);
  EXPECT_LT((Tall() * x - b).norm(), 1e-12);
  // No part along what A does not see, (1, 1, -1).
  EXPECT_NEAR(x[0] + x[1] - x[2], 0.0, 1e-12);
  EXPECT_NEAR(x.squaredNorm(), 3.0 - 1.0 / 3.0, 1e-12);
}

TEST(Decompositions, FactorWhatIsPositiveAndSayWhatIsNot) {
  const MatrixXd A = Tall().leftCols(2).transpose() * Tall().leftCols(2);
  const Cholesky factor(A);
  ASSERT_TRUE(factor.Valid());
  EXPECT_LT((factor.L() * factor.L().transpose() - A).norm(), 1e-12);
  EXPECT_EQ(factor.L()(0, 1), 0.0);
  EXPECT_LT((A * factor.Solve(VectorXd(VectorXd::Ones(2))) - VectorXd::Ones(2))
                .norm(),
            1e-12);
  EXPECT_NEAR(factor.LogDeterminant(),
              std::log(A(0, 0) * A(1, 1) - A(1, 0) * A(1, 0)), 1e-12);
  EXPECT_FALSE(Cholesky(-A).Valid());
}

TEST(Decompositions, TakeTheRootOfACovarianceThatMayBeSingular) {
  const MatrixXd S = Tall().transpose() * Tall();  // of rank 2
  const MatrixXd F = RootOfCovariance(S);
  EXPECT_LT((F * F.transpose() - S).norm(), 1e-12 * S.norm());
  // What rounding makes of zero is zero.
  MatrixXd rounded = MatrixXd::Zero(2, 2);
  rounded(0, 0) = 4.0;
  rounded(1, 1) = -1e-18;
  const MatrixXd root = RootOfCovariance(rounded);
  EXPECT_TRUE(root.allFinite());
  EXPECT_LT((root * root.transpose() - rounded).norm(), 1e-15);
}

TEST(Decompositions, FindSmallSingularValuesAsWellAsLargeOnes) {
  MatrixXd A = MatrixXd::Zero(3, 2);
  A(0, 0) = 1e8;
  A(1, 1) = 1e-8;
  const SingularValues svd = SingularValuesOf(A);
  EXPECT_NEAR(svd.s[0], 1e8, 1e-6);
  EXPECT_NEAR(svd.s[1], 1e-8, 1e-22);
  EXPECT_LT((svd.U * svd.s.asDiagonal() * svd.V.transpose() - A).norm(), 1e-8);
}

}  // namespace
}  // namespace sysid
