#include "sysid/unexplained_force/smooth_force.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numeric>
#include <random>

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Two runs with two degrees of freedom and one parameter, in segments that see
// four knots each; all of it also as one dense problem.
class SmallProblem : public testing::Test {
 protected:
  static constexpr int kNv = 2, kKnots = 16, kSize = kNv * kKnots;

  // Forces of these sizes, with noise of this much more than was known.
  void Make(double first, double second, double noise) {
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    equations_ = ForceEquations();
    equations_.nv = kNv;
    equations_.N = MatrixXd::Zero(1, 1);
    equations_.t = VectorXd::Zero(1);
    J_.resize(0, 0);
    std::vector<MatrixXd> parts;
    std::vector<VectorXd> rs;
    for (int run = 0; run < 2; ++run) {
      ForceEquations::Run part;
      part.knots = kKnots;
      part.G = BlockTridiagonal::Zero({0, 8, 14, 20, 26, kSize});
      part.C = MatrixXd::Zero(kSize, 1);
      part.g = VectorXd::Zero(kSize);
      VectorXd truth(kSize);
      for (int k = 0; k < kKnots; ++k) {
        truth[kNv * k] = first * std::sin(0.7 * k + run);
        truth[kNv * k + 1] = second * std::cos(0.5 * k);
      }
      for (int s = 0; s < 5; ++s) {
        constexpr int kRows = 40;
        const int at = kNv * 3 * s, size = kNv * 4;
        MatrixXd A(kRows, size), theta(kRows, 1);
        VectorXd r(kRows);
        for (double& x : A.reshaped()) x = normal(random);
        for (double& x : theta.reshaped()) x = normal(random);
        for (double& x : r) x = noise * normal(random);
        r -= A * truth.segment(at, size);
        part.G.Add(at, A.transpose() * A);
        part.C.middleRows(at, size) += A.transpose() * theta;
        part.g.segment(at, size) += A.transpose() * r;
        equations_.N += theta.transpose() * theta;
        equations_.t += theta.transpose() * r;
        equations_.squares += r.squaredNorm();
        equations_.dof += kRows;
        MatrixXd whole = MatrixXd::Zero(kRows, 2 * kSize + 1);
        whole.middleCols(run * kSize + at, size) = A;
        whole.col(2 * kSize) = theta;
        parts.push_back(whole);
        rs.push_back(r);
      }
      equations_.runs.push_back(part);
    }
    J_.resize(400, 2 * kSize + 1);
    r_.resize(400);
    for (size_t i = 0; i < parts.size(); ++i) {
      J_.middleRows(40 * i, 40) = parts[i];
      r_.segment(40 * i, 40) = rs[i];
    }
  }

  // The prior (7.8), from its definition.
  MatrixXd Prior(const SmoothForce& force) const {
    MatrixXd L = MatrixXd::Zero(kKnots, kKnots);
    for (int k = 0; k + 1 < kKnots; ++k) {
      L.block(k, k, 2, 2) += (MatrixXd(2, 2) << 1, -1, -1, 1).finished();
    }
    const MatrixXd unit = std::pow(force.time_scale(), 4) * L * L +
                          MatrixXd::Identity(kKnots, kKnots);
    const double nu = unit.inverse().trace() / kKnots;
    MatrixXd P = MatrixXd::Zero(2 * kSize + 1, 2 * kSize + 1);
    for (int run = 0; run < 2; ++run) {
      for (int k = 0; k < kKnots; ++k) {
        for (int l = 0; l < kKnots; ++l) {
          for (int d = 0; d < kNv; ++d) {
            P(run * kSize + kNv * k + d, run * kSize + kNv * l + d) =
                nu * unit(k, l) / std::pow(force.width(d), 2);
          }
        }
      }
    }
    return P;
  }

  ForceEquations equations_;
  MatrixXd J_;  // both runs, then the parameter
  VectorXd r_;
};

TEST_F(SmallProblem, IsSolvedAsTheDenseOne) {
  Make(3.0, 0.5, 2.0);
  const SmoothForce force(equations_);
  const MatrixXd inverse =
      (J_.transpose() * J_ / force.variance() + Prior(force)).inverse();
  const VectorXd phi = -inverse * J_.transpose() * r_ / force.variance();
  const MatrixXd law = MatrixXd::Random(2 * kSize, 1);
  const VectorXd smoothed = inverse * J_.transpose() *
                            (J_.leftCols(2 * kSize) * law) / force.variance();
  const std::vector<MatrixXd> smooth =
      force.Smooth({law.topRows(kSize), law.bottomRows(kSize)});
  for (int run = 0; run < 2; ++run) {
    const RowMatrixXd values = force.Values(run), std = force.Deviations(run);
    for (int i = 0; i < kSize; ++i) {
      const int at = run * kSize + i;
      EXPECT_NEAR(values.data()[i], phi[at], 1e-9);
      EXPECT_NEAR(std.data()[i], std::sqrt(inverse(at, at)), 1e-9);
      EXPECT_NEAR(smooth[run](i, 0), smoothed[at], 1e-9);
    }
  }
  // What noise alone puts into the first degree of freedom.
  const MatrixXd map = inverse * J_.transpose() / force.variance();
  double expected = 0.0;
  std::vector<std::vector<int>> rows(2);
  for (int run = 0; run < 2; ++run) {
    for (int i = 0; i < kSize; i += kNv) {
      rows[run].push_back(i);
      expected += force.variance() * map.row(run * kSize + i).squaredNorm();
    }
  }
  EXPECT_NEAR(force.NoiseSquares(rows), expected, 0.2 * expected);
}

TEST_F(SmallProblem, FindsWidthsAndNoise) {
  Make(3.0, 0.5, 2.0);
  const SmoothForce force(equations_);
  // Of the size of the forces; the smoother they are, the larger it may be.
  EXPECT_GT(force.width(0), 3.0 / std::sqrt(2.0) / 1.5);
  EXPECT_LT(force.width(0), 3.0 / std::sqrt(2.0) * 3.0);
  EXPECT_GT(force.width(1), 0.5 / std::sqrt(2.0) / 1.5);
  EXPECT_LT(force.width(1), 0.5 / std::sqrt(2.0) * 3.0);
  EXPECT_NEAR(force.variance(), 4.0, 0.6);
  EXPECT_LT(force.WeightOf(0, 1).p_value, 1e-10);
  EXPECT_LT(force.WeightOf(1, 1).p_value, 1e-3);
  EXPECT_GT(force.WeightOf(0, 1).share, force.WeightOf(1, 1).share);
  EXPECT_GT(force.WeightOf(0, 1).share, 0.5);
}

TEST_F(SmallProblem, SeesNoForceWhereThereIsNone) {
  Make(3.0, 0.0, 1.0);
  const SmoothForce force(equations_);
  EXPECT_GT(force.WeightOf(1, 1).p_value, 0.05);
  EXPECT_LT(force.WeightOf(1, 1).share, 0.01);
  EXPECT_LT(force.width(1), 0.1);
  for (int run = 0; run < 2; ++run) {
    const RowMatrixXd z =
        force.Values(run).cwiseQuotient(force.Deviations(run));
    EXPECT_LT(z.col(1).cwiseAbs().maxCoeff(), 3.0);
    EXPECT_GT(z.col(0).cwiseAbs().maxCoeff(), 10.0);
  }
}

TEST_F(SmallProblem, LeavesOutWhatTheDataDoesNotShow) {
  Make(3.0, 0.5, 1.0);
  for (ForceEquations::Run& run : equations_.runs) {
    for (int k = 1; k < kSize; k += 2) {
      for (int l = 0; l < kSize; ++l) {
        if (std::abs(run.G.BlockOf(k) - run.G.BlockOf(l)) > 1) continue;
        run.G.At(k, l) = 0.0;
        if (run.G.BlockOf(k) == run.G.BlockOf(l)) {
          const int b = run.G.BlockOf(k), at = run.G.first[b];
          run.G.diagonal[b](l - at, k - at) = 0.0;
          run.G.diagonal[b](k - at, l - at) = 0.0;
        }
      }
      run.g[k] = 0.0;
      run.C.row(k).setZero();
    }
  }
  const SmoothForce force(equations_);
  EXPECT_TRUE(force.Seen(0));
  EXPECT_FALSE(force.Seen(1));
  EXPECT_EQ(force.WeightOf(1, 1).p_value, 1.0);
  EXPECT_TRUE(force.Values(0).allFinite());
  EXPECT_LT(force.WeightOf(0, 1).p_value, 1e-10);
}

}  // namespace
}  // namespace sysid
