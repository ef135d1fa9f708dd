#include "sysid/inverse_dynamics/equation_products.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace sysid {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

// Of one joint: r = (2, 1, 4), J of three columns.
EquationProducts Three() {
  EquationRows rows;
  rows.nv = 1;
  rows.t = {0.0, 1.0, 2.0};
  rows.rests.setConstant(3, 1, false);
  rows.rows.resize(3, 4);
  rows.rows << 1, 1, 0, 2, 0, 1, 0, 1, 0, 0, 2, 4;
  return MultiplyRows(rows, 0, 3, ColumnsOfJoints({rows}));
}

Eigen::VectorXd Solve(const EquationProducts& products,
                      const std::vector<int>& at, const ChangeBounds& bounds) {
  return SolveWeighted(Weigh(products, at, Eigen::VectorXd::Ones(1)), at,
                       bounds);
}

// Rows at rest tell nothing.
TEST(MultiplyRows, LeavesRestsOut) {
  EquationRows rows;
  rows.nv = 1;
  rows.t = {0.0, 1.0};
  rows.rests.setConstant(2, 1, false);
  rows.rests(1, 0) = true;
  rows.rows.resize(2, 2);
  rows.rows << 1, 2, 5, 7;
  const EquationProducts products = MultiplyRows(rows, 0, 2, {{0}});
  EXPECT_EQ(products.times[0], 1.0);
  EXPECT_EQ(products.of[0].G, (Eigen::Matrix2d{{1, 2}, {2, 4}}));
}

// A column that does not act on a joint is none of its products.
TEST(ColumnsOfJoints, AreThoseThatActOnThem) {
  EquationRows rows;
  rows.nv = 2;
  rows.t = {0.0};
  rows.rests.setConstant(1, 2, false);
  rows.rows.resize(2, 4);
  rows.rows << 1, 0, 3, 5, 0, 0, 2, 7;
  const std::vector<std::vector<int>> columns = ColumnsOfJoints({rows});
  EXPECT_EQ(columns, (std::vector<std::vector<int>>{{0, -1, 1}, {-1, -1, 0}}));
  const EquationProducts products = MultiplyRows(rows, 0, 1, columns);
  EXPECT_EQ(products.of[1].G, (Eigen::Matrix2d{{4, 14}, {14, 49}}));
  EXPECT_FALSE(products.of[1].Has(0));
  // |5 + (1, 0, 3) d|^2 and |7 + (0, 0, 2) d|^2.
  const Eigen::Vector3d d(1, 10, -2);
  EXPECT_EQ(products.Left(0, {0, 1, 2}, d), 0.0);
  EXPECT_EQ(products.Left(1, {0, 1, 2}, d), 9.0);
}

// (d - 2)^2 / 1 + d^2 / 4: a belief draws to where it begins.
TEST(Weigh, AddsWhatIsBelieved) {
  EquationProducts products;
  products.times = Eigen::VectorXd::Ones(1);
  products.of = {JointProducts(Eigen::Matrix2d{{1, -2}, {-2, 4}})};
  const Eigen::VectorXd d =
      SolveWeighted(Weigh(products, {0}, Eigen::VectorXd::Ones(1),
                          Eigen::MatrixXd::Constant(1, 1, 0.25)),
                    {0},
                    {Eigen::VectorXd::Constant(1, -kNone),
                     Eigen::VectorXd::Constant(1, kNone)});
  EXPECT_NEAR(d[0], 1.6, 1e-12);
}

TEST(SolveWeighted, LeavesNothingWhereItCan) {
  const ChangeBounds none = {Eigen::Vector3d::Constant(-kNone),
                             Eigen::Vector3d::Constant(kNone)};
  const Eigen::VectorXd d = Solve(Three(), {0, 1, 2}, none);
  EXPECT_LT((d - Eigen::Vector3d(-1, -1, -2)).norm(), 1e-12);
  EXPECT_NEAR(Three().Left(0, {0, 1, 2}, d), 0.0, 1e-12);
}

// What a bound holds, the others make up for as far as they can.
TEST(SolveWeighted, SolvesForTheRestWhereABoundHolds) {
  const ChangeBounds bounds = {Eigen::Vector3d(-0.5, -kNone, -kNone),
                               Eigen::Vector3d(kNone, kNone, kNone)};
  const Eigen::VectorXd d = Solve(Three(), {0, 1, 2}, bounds);
  // The least of (1.5 + b)^2 + (1 + b)^2.
  EXPECT_LT((d - Eigen::Vector3d(-0.5, -1.25, -2)).norm(), 1e-12);
  // Of some columns, by their own bounds.
  const Eigen::VectorXd two = Solve(Three(), {0, 2}, bounds);
  EXPECT_LT((two - Eigen::Vector2d(-0.5, -2)).norm(), 1e-12);
}

// Two columns that nearly depend on each other ask for (100, -99): with the
// first at its bound the second needs its own no longer.
TEST(SolveWeighted, HoldsNoMoreThanItMust) {
  EquationProducts products;
  products.times = Eigen::VectorXd::Ones(1);
  products.of = {JointProducts(
      Eigen::Matrix3d{{1, 0.99, -1.99}, {0.99, 1, 0}, {-1.99, 0, 9}})};
  const ChangeBounds bounds = {Eigen::Vector2d(-kNone, -50),
                               Eigen::Vector2d(1, kNone)};
  const Eigen::VectorXd d = Solve(products, {0, 1}, bounds);
  EXPECT_LT((d - Eigen::Vector2d(1, -0.99)).norm(), 1e-9);
}

}  // namespace
}  // namespace sysid
