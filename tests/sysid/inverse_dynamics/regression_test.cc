#include "sysid/inverse_dynamics/regression.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <random>
#include <vector>

namespace sysid {
namespace {

constexpr int kJoints = 2, kColumns = 3;

// Random rows, with errors that are correlated over some ten times.
EquationRows RandomRows(int times, int seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  EquationRows rows;
  rows.nv = kJoints;
  rows.rows.resize(times * kJoints, kColumns + 1);
  rows.effort.setOnes(times, kJoints);
  rows.qd.setZero(times, kJoints);
  rows.qdd.setZero(times, kJoints);
  rows.rests.setConstant(times, kJoints, false);
  double error[kJoints] = {};
  for (int k = 0; k < times; ++k) {
    rows.t.push_back(k);
    for (int v = 0; v < kJoints; ++v) {
      for (int c = 0; c < kColumns; ++c) {
        rows.rows(k * kJoints + v, c) = std::sin(0.1 * k * (c + 1)) + v * c;
      }
      error[v] = 0.9 * error[v] + (1 + v) * normal(random);
      rows.rows(k * kJoints + v, kColumns) = error[v];
    }
  }
  return rows;
}

// The change that solves the rows of some times, each joint by its own weight.
Eigen::VectorXd Solve(const EquationRows& rows, const Eigen::VectorXd& sigma,
                      const std::vector<int>& times) {
  Eigen::MatrixXd A(times.size() * kJoints, kColumns + 1);
  int at = 0;
  for (const int k : times) {
    for (int v = 0; v < kJoints; ++v) {
      A.row(at++) = rows.rows.row(k * kJoints + v) / sigma[v];
    }
  }
  return -A.leftCols(kColumns).colPivHouseholderQr().solve(A.col(kColumns));
}

// (11.6): by how much the estimates without a block move, block by block.
TEST(EquationRegression, ErrorsAreThoseOfEstimatesWithoutABlock) {
  // Of a run of n times, n / (2 n^(1/3) + 1) blocks, at least two.
  const std::vector<int> times = {125, 216, 4}, blocks = {11, 16, 2};
  std::vector<EquationRows> runs;
  for (size_t r = 0; r < times.size(); ++r) {
    runs.push_back(RandomRows(times[r], static_cast<int>(r)));
  }
  EquationRegression regression(kJoints, kColumns, runs, {}, RobustLoss::kNone,
                                3.0, 1);
  const Eigen::VectorXd d = SolveUnconstrained(regression.Triangle());

  EquationRows all = RandomRows(times[0] + times[1] + times[2], 0);
  all.rows << runs[0].rows, runs[1].rows, runs[2].rows;
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(kColumns, kColumns);
  int first = 0;
  for (size_t r = 0; r < times.size(); ++r) {
    for (int b = 0; b < blocks[r]; ++b) {
      const int from = first + times[r] * b / blocks[r];
      const int to = first + times[r] * (b + 1) / blocks[r];
      std::vector<int> others;
      for (int k = 0; k < static_cast<int>(all.t.size()); ++k) {
        if (k < from || k >= to) others.push_back(k);
      }
      const Eigen::VectorXd moved = Solve(all, regression.sigma(), others) - d;
      expected += moved * moved.transpose();
    }
    first += times[r];
  }

  const Eigen::MatrixXd R = regression.Triangle().leftCols(kColumns);
  const Eigen::MatrixXd root =
      R.inverse() * regression.ErrorRoot(regression.Triangle(), d);
  EXPECT_LT((root * root.transpose() - expected).norm(),
            1e-4 * expected.norm());
}

// A wrist's small efforts are weighed by their own size; none at all by the
// largest of the others, and a machine without efforts by one.
TEST(EquationRegression, BeginsWithTheSizeOfEachJointsEfforts) {
  const auto begins_with = [](double first, double second) -> Eigen::VectorXd {
    EquationRows rows = RandomRows(50, 1);
    rows.effort.col(0).setConstant(first);
    rows.effort.col(1).setConstant(second);
    return EquationRegression(kJoints, kColumns, {rows}, {}, RobustLoss::kNone,
                              3.0, 1)
        .sigma();
  };
  EXPECT_TRUE(begins_with(80.0, 0.02).isApprox(Eigen::Vector2d(80.0, 0.02)));
  EXPECT_TRUE(begins_with(80.0, 0.0).isApprox(Eigen::Vector2d(80.0, 80.0)));
  EXPECT_TRUE(begins_with(0.0, 0.0).isApprox(Eigen::Vector2d(1.0, 1.0)));
}

}  // namespace
}  // namespace sysid
