#include "models/effects/force_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "models/math/decompositions.h"
#include "tests/support/all_joints.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

class ForceTableTest : public ::testing::Test {
 protected:
  explicit ForceTableTest(const std::string& joint = "hinge")
      : mechanism_(AllJoints()),
        table_(mechanism_, joint),
        type_(mechanism_.joints[table_.joint()].type) {
    for (const EffectParameter& parameter : table_.parameters()) {
      p_.push_back(parameter.null_value);
    }
  }

  double At(double q, double qd) const { return At(q, qd, p_); }
  double At(double q, double qd, const std::vector<double>& p) const {
    double force = 0.0;
    table_.HooksFor(ScalarTag<double>())
        .AddEffort({type_, 1, &q, &qd}, p.data(), &force);
    return force;
  }
  // The force per weight.
  VectorXd Weights(double q, double qd) const {
    VectorXd row(ForceTable::kWeights);
    std::vector<double> p = p_;
    for (int k = 0; k < ForceTable::kWeights; ++k) {
      p[k] = 1.0;
      row[k] = At(q, qd, p);
      p[k] = 0.0;
    }
    return row;
  }
  void SetRange(double below, double above, double speed) {
    p_[ForceTable::kBelow] = below;
    p_[ForceTable::kAbove] = above;
    p_[ForceTable::kSpeed] = speed;
  }
  // The weights of largest posterior: independent, N(0, 1), and forces with
  // errors of `sigma`, N m.
  void Fit(const std::function<double(double, double)>& force,
           const std::vector<std::pair<double, double>>& points,
           double sigma = 1e-3) {
    MatrixXd A(points.size() + ForceTable::kWeights, ForceTable::kWeights);
    VectorXd b = VectorXd::Zero(A.rows());
    for (size_t i = 0; i < points.size(); ++i) {
      const auto [q, qd] = points[i];
      A.row(i) = Weights(q, qd).transpose() / sigma;
      b[i] = force(q, qd) / sigma;
    }
    A.bottomRows(ForceTable::kWeights).setIdentity();
    const VectorXd w = LeastSquares(A, b);
    std::copy(w.begin(), w.end(), p_.begin());
  }

  const Mechanism mechanism_;
  const ForceTable table_;
  const JointType type_;
  std::vector<double> p_;
};

std::vector<std::pair<double, double>> Grid(double below, double above,
                                            double speed, int n = 25) {
  std::vector<std::pair<double, double>> points;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      points.push_back({-below + (above + below) * i / (n - 1),
                        ForceTable::SpeedAt(2.0 * j / (n - 1) - 1.0, speed)});
    }
  }
  return points;
}

double Surface(double q, double qd) {
  return 1.2 * std::sin(1.5 * q) - 0.3 * qd + 0.4 * q * std::tanh(qd);
}

TEST_F(ForceTableTest, ReproducesASmoothSurface) {
  SetRange(1.0, 1.5, 4.0);
  const auto points = Grid(1.0, 1.5, 4.0);
  Fit(Surface, points);
  double worst = 0.0;
  for (const auto& [q, qd] : points) {
    worst = std::max(worst, std::abs(At(q, qd) - Surface(q, qd)));
  }
  // Of forces up to 2.9 N m. Linear between the same knots it would miss 0.09
  // of -0.3 qd alone.
  EXPECT_LT(worst, 0.07);
}

TEST_F(ForceTableTest, FollowsFromItsNeighboursWhereThereIsNoData) {
  SetRange(1.0, 1.5, 4.0);
  std::vector<std::pair<double, double>> points;
  for (const auto& [q, qd] : Grid(1.0, 1.5, 4.0)) {
    if (std::hypot(q - 0.4, qd - 1.0) > 0.5) points.push_back({q, qd});
  }
  Fit(Surface, points);
  EXPECT_NEAR(At(0.4, 1.0), Surface(0.4, 1.0), 0.1);
  EXPECT_NEAR(At(0.5, 0.8), Surface(0.5, 0.8), 0.1);
}

TEST_F(ForceTableTest, IsContinuousWithItsSlopeAcrossKnotsAndEnds) {
  SetRange(1.0, 1.5, 4.0);
  Fit(Surface, Grid(1.0, 1.5, 4.0));
  constexpr double kStep = 1e-6;
  const auto slopes_agree = [&](const std::function<double(double)>& f,
                                double at) {
    const double before = (f(at) - f(at - kStep)) / kStep;
    const double after = (f(at + kStep) - f(at)) / kStep;
    EXPECT_NEAR(before, after, 1e-4) << "at " << at;
  };
  for (int knot = 0; knot < ForceTable::kKnots; ++knot) {
    slopes_agree([&](double q) { return At(q, 0.7); },
                 -1.0 + 2.5 * knot / (ForceTable::kKnots - 1));
    slopes_agree(
        [&](double qd) { return At(0.3, qd); },
        ForceTable::SpeedAt(2.0 * knot / (ForceTable::kKnots - 1) - 1.0, 4.0));
  }
}

TEST_F(ForceTableTest, StaysBoundedOutsideOfItsRange) {
  SetRange(1.0, 1.5, 4.0);
  Fit(Surface, Grid(1.0, 1.5, 4.0));
  EXPECT_NEAR(At(100.0, 0.5), At(1000.0, 0.5), 1e-9);
  EXPECT_LT(std::abs(At(100.0, 1000.0)), 10.0);
}

class TurningTableTest : public ForceTableTest {
 protected:
  TurningTableTest() : ForceTableTest("wheel") {}
};

TEST_F(TurningTableTest, IsPeriodicOverATurnOfAContinuousJoint) {
  SetRange(M_PI, M_PI, 3.0);
  const auto force = [](double q, double qd) {
    return std::sin(q) + 0.5 * std::cos(2 * q) - 0.1 * qd;
  };
  Fit(force, Grid(M_PI, M_PI, 3.0));
  for (const double q : {-3.0, -0.5, 0.1, 2.0}) {
    EXPECT_NEAR(At(q, 0.4), force(q, 0.4), 0.15);
    EXPECT_NEAR(At(q + 2 * M_PI, 0.4), At(q, 0.4), 1e-12);
    EXPECT_NEAR(At(q - 4 * M_PI, 0.4), At(q, 0.4), 1e-12);
  }
  EXPECT_NEAR(At(M_PI - 1e-7, 0.4), At(-M_PI + 1e-7, 0.4), 1e-5);
}

TEST_F(TurningTableTest, IsThatOfTheNearestTurnOverLess) {
  SetRange(0.5, 1.0, 3.0);
  Fit([](double q, double) { return q; }, Grid(0.5, 1.0, 3.0));
  EXPECT_NEAR(At(0.8 + 2 * M_PI, 0.1), 0.8, 0.02);
}

}  // namespace
}  // namespace sysid
