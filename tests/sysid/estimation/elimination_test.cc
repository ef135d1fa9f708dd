#include "sysid/estimation/elimination.h"

#include <gmock/gmock.h>

#include <Eigen/Cholesky>

#include "tests/support/random_mechanism.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

RowMatrixXd RandomMatrix(int rows, int columns, Random* random) {
  RowMatrixXd m(rows, columns);
  for (double& entry : m.reshaped()) entry = random->Normal();
  return m;
}

// A run of segments with so many rows each.
RunLinearization RandomRun(const std::vector<int>& rows, int tangent,
                           int n_theta, Random* random) {
  RunLinearization run;
  run.J_prior = RandomMatrix(tangent, tangent, random);
  run.r_prior = random->NormalVector(tangent);
  for (size_t k = 0; k < rows.size(); ++k) {
    SegmentLinearization segment;
    segment.J_x = RandomMatrix(rows[k], tangent, random);
    segment.J_theta = RandomMatrix(rows[k], n_theta, random);
    if (k + 1 < rows.size()) {
      segment.J_next = RandomMatrix(rows[k], tangent, random);
    }
    segment.r = random->NormalVector(rows[k]);
    run.segments.push_back(std::move(segment));
  }
  return run;
}

// J^T J and J^T r of everything: theta first, then every state.
struct Dense {
  Dense(const std::vector<RunLinearization>& runs, const RowMatrixXd& J_prior,
        const VectorXd& r_prior) {
    n_theta = static_cast<int>(J_prior.cols());
    const int tangent = static_cast<int>(runs.front().J_prior.cols());
    int states = 0;
    for (const auto& run : runs) {
      states += static_cast<int>(run.segments.size());
    }
    const int n = n_theta + states * tangent;
    H.setZero(n, n);
    g.setZero(n);
    const auto add = [&](const MatrixXd& J, const VectorXd& r) {
      H += J.transpose() * J;
      g += J.transpose() * r;
    };
    MatrixXd J = MatrixXd::Zero(J_prior.rows(), n);
    J.leftCols(n_theta) = J_prior;
    add(J, r_prior);
    int at = n_theta;
    for (const RunLinearization& run : runs) {
      J.setZero(tangent, n);
      J.middleCols(at, tangent) = run.J_prior;
      add(J, run.r_prior);
      for (const SegmentLinearization& segment : run.segments) {
        J.setZero(segment.J_x.rows(), n);
        J.leftCols(n_theta) = segment.J_theta;
        J.middleCols(at, tangent) = segment.J_x;
        if (segment.J_next.size() > 0) {
          J.middleCols(at + tangent, tangent) = segment.J_next;
        }
        add(J, segment.r);
        at += tangent;
      }
    }
  }
  // The Schur complement on theta, and its right-hand side.
  MatrixXd Schur() const {
    return H.topLeftCorner(n_theta, n_theta) - Coupling() * Rest().transpose();
  }
  VectorXd Gradient() const {
    return g.head(n_theta) - Coupling() * g.tail(g.size() - n_theta);
  }
  MatrixXd Rest() const {
    return H.topRightCorner(n_theta, H.cols() - n_theta);
  }
  MatrixXd Coupling() const {
    const int n = static_cast<int>(H.cols()) - n_theta;
    return H.bottomRightCorner(n, n)
        .ldlt()
        .solve(Rest().transpose())
        .transpose();
  }
  int n_theta;
  MatrixXd H;
  VectorXd g;
};

void ExpectEliminates(const std::vector<RunLinearization>& runs,
                      const RowMatrixXd& J_prior, const VectorXd& r_prior) {
  const int n = static_cast<int>(J_prior.cols());
  const Dense dense(runs, J_prior, r_prior);
  const RowMatrixXd R = EliminateStates(runs, J_prior, r_prior, 1);
  ASSERT_EQ(R.rows(), n);
  ASSERT_EQ(R.cols(), n + 1);
  EXPECT_TRUE(R.leftCols(n).isUpperTriangular(0.0));
  const MatrixXd S = dense.Schur();
  EXPECT_LT((R.leftCols(n).transpose() * R.leftCols(n) - S).norm(),
            1e-9 * (1.0 + S.norm()));
  const VectorXd g = dense.Gradient();
  EXPECT_LT((R.leftCols(n).transpose() * R.col(n) - g).norm(),
            1e-9 * (1.0 + g.norm()));
}

TEST(EliminateStates, IsTheSchurComplementOfTheDenseProblem) {
  Random random(1);
  const RowMatrixXd none(0, 3);
  for (int i = 0; i < 10; ++i) {
    ExpectEliminates(
        {RandomRun({9, 12, 7, 10, 8}, 4, 3, &random),
         RandomRun({11, 6}, 4, 3, &random), RandomRun({10}, 4, 3, &random)},
        none, VectorXd(0));
  }
}

TEST(EliminateStates, CountsThePriorsOfTheta) {
  Random random(2);
  ExpectEliminates({RandomRun({9, 12, 7}, 4, 3, &random)},
                   RandomMatrix(2, 3, &random), random.NormalVector(2));
}

TEST(EliminateStates, MindsSegmentsThatSayLittle) {
  Random random(3);
  // The fewest rows that a defect gives, and a last segment without any.
  ExpectEliminates({RandomRun({4, 4, 5, 4, 0}, 4, 3, &random),
                    RandomRun({8, 2}, 4, 3, &random)},
                   RowMatrixXd(0, 3), VectorXd(0));
}

TEST(EliminateStates, KnowsNothingWithoutData) {
  Random random(4);
  RunLinearization run = RandomRun({0}, 4, 3, &random);
  const RowMatrixXd R =
      EliminateStates({run}, RowMatrixXd(0, 3), VectorXd(0), 1);
  EXPECT_EQ(R, RowMatrixXd::Zero(3, 4));
}

// A damped step of everything, from the reductions of the runs alone: theta's
// from their merged roots, then each run's states by itself.
TEST(RunReduction, GivesTheDampedStepOfTheDenseProblem) {
  Random random(6);
  constexpr int kTangent = 4, kTheta = 3;
  const std::vector<RunLinearization> runs = {
      RandomRun({9, 12, 7}, kTangent, kTheta, &random),
      RandomRun({11, 6}, kTangent, kTheta, &random),
      RandomRun({3}, kTangent, kTheta, &random)};
  const VectorXd damping =
      random.NormalVector(kTangent).cwiseAbs() + VectorXd::Constant(4, 0.1);
  const VectorXd theta_damping =
      random.NormalVector(kTheta).cwiseAbs() + VectorXd::Constant(3, 0.1);
  Dense dense(runs, RowMatrixXd(0, kTheta), VectorXd(0));
  dense.H.diagonal().head(kTheta) += theta_damping.cwiseAbs2();
  for (int at = kTheta; at < dense.H.cols(); at += kTangent) {
    dense.H.diagonal().segment(at, kTangent) += damping.cwiseAbs2();
  }
  const VectorXd step = -dense.H.ldlt().solve(dense.g);
  std::vector<RunReduction> reduced;
  std::vector<RowMatrixXd> roots;
  for (const RunLinearization& run : runs) {
    reduced.emplace_back(run, damping);
    roots.push_back(reduced.back().root());
  }
  RowMatrixXd damped = RowMatrixXd::Zero(kTheta, kTheta + 1);
  damped.leftCols(kTheta) = theta_damping.asDiagonal();
  roots.push_back(damped);
  const RowMatrixXd R = MergeRoots(roots);
  const VectorXd dtheta = -R.topLeftCorner(kTheta, kTheta)
                               .triangularView<Eigen::Upper>()
                               .solve(R.topRightCorner(kTheta, 1))
                               .col(0);
  EXPECT_LT((dtheta - step.head(kTheta)).norm(), 1e-11 * step.norm());
  int at = kTheta;
  for (const RunReduction& run : reduced) {
    const RowMatrixXd dx = run.SubstituteBack(dtheta);
    for (int k = 0; k < dx.rows(); ++k, at += kTangent) {
      EXPECT_LT((dx.row(k).transpose() - step.segment(at, kTangent)).norm(),
                1e-11 * step.norm());
    }
  }
  EXPECT_EQ(at, step.size());
}

// The cost of the best states is known from the root alone.
TEST(RunReduction, KeepsTheCost) {
  Random random(7);
  const RunLinearization run = RandomRun({9, 12, 7}, 4, 3, &random);
  const Dense dense({run}, RowMatrixXd(0, 3), VectorXd(0));
  double squares = run.r_prior.squaredNorm();
  for (const auto& segment : run.segments) squares += segment.r.squaredNorm();
  const VectorXd dtheta = random.NormalVector(3);
  VectorXd homogeneous(4);
  homogeneous << dtheta, 1.0;
  const double from_root =
      (RunReduction(run).root() * homogeneous).squaredNorm();
  // |r|^2 + 2 g' d + d' H d at the best states for dtheta.
  const int n = static_cast<int>(dense.H.cols()) - 3;
  const MatrixXd H_xx = dense.H.bottomRightCorner(n, n);
  const VectorXd b = dense.g.tail(n) + dense.H.bottomLeftCorner(n, 3) * dtheta;
  const double expected = squares + 2.0 * dense.g.head(3).dot(dtheta) +
                          dtheta.dot(dense.H.topLeftCorner(3, 3) * dtheta) -
                          b.dot(H_xx.ldlt().solve(b));
  EXPECT_NEAR(from_root, expected, 1e-10 * squares);
}

// In any order and any grouping the same information.
TEST(MergeRoots, DoesNotDependOnTheOrder) {
  Random random(8);
  std::vector<RowMatrixXd> roots;
  for (int r = 0; r < 5; ++r) {
    roots.push_back(RunReduction(RandomRun({9, 5 + r}, 4, 3, &random)).root());
  }
  const RowMatrixXd all = MergeRoots(roots);
  const RowMatrixXd grouped =
      MergeRoots({MergeRoots({roots[4], roots[1]}),
                  MergeRoots({roots[3], MergeRoots({roots[0], roots[2]})})});
  const MatrixXd H = all.transpose() * all;
  EXPECT_LT((grouped.transpose() * grouped - H).norm(), 1e-13 * H.norm());
}

TEST(EliminateStates, HoldsStiffDefects) {
  Random random(5);
  // Rows of 1e4 beside rows of 1: what squares them loses half the digits.
  std::vector<RunLinearization> runs = {RandomRun({9, 12, 7}, 2, 2, &random)};
  for (SegmentLinearization& segment : runs[0].segments) {
    if (segment.J_next.size() == 0) continue;
    const double stiff = 1e4;
    segment.J_x.bottomRows(2) *= stiff;
    segment.J_next.bottomRows(2) *= stiff;
    segment.J_theta.bottomRows(2) *= stiff;
    segment.r.tail(2) *= stiff;
  }
  const Dense dense(runs, RowMatrixXd(0, 2), VectorXd(0));
  const RowMatrixXd R =
      EliminateStates(runs, RowMatrixXd(0, 2), VectorXd(0), 1);
  const MatrixXd S = dense.Schur();
  EXPECT_LT((R.leftCols(2).transpose() * R.leftCols(2) - S).norm(),
            1e-6 * S.norm());
}

}  // namespace
}  // namespace sysid
