#include "sysid/inverse_dynamics/estimate.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

#include "tests/sysid/inverse_dynamics/two_links.h"

namespace sysid {
namespace {

// Rows that know every coordinate: R = weight 1, with the minimum at `wanted`.
RowMatrixXd Knowing(const Eigen::VectorXd& change, double weight) {
  const int n = static_cast<int>(change.size());
  RowMatrixXd triangle(n, n + 1);
  triangle.leftCols(n) = weight * RowMatrixXd::Identity(n, n);
  triangle.col(n) = -weight * change;
  return triangle;
}

class EstimateTest : public testing::Test {
 protected:
  EstimateTest()
      : model_(FrictionArm(0.1)),
        problem_(model_, Names(), {Shaken(model_, 0.0, 1, 0.5)}, {}),
        coordinates_(model_, problem_.map().parameters()) {}
  std::vector<FreeParameter> Names() const {
    std::vector<std::string> names = AllOf({"link2"});
    names.push_back("joint1.friction");
    return FreeNominal(model_, names);
  }
  RegressionEstimate Estimate(const Eigen::VectorXd& change, double weight) {
    return EstimateByRegression(problem_, coordinates_, Knowing(change, weight),
                                problem_.InitialTheta());
  }
  Eigen::VectorXd Xi0() const {
    Eigen::VectorXd xi(coordinates_.size());
    coordinates_.Read<double>(model_.nominal(), xi.data());
    return xi;
  }
  // (11.8).
  static Eigen::Matrix4d PseudoInertia(const Eigen::VectorXd& xi) {
    const Inertial<double> body = EquationCoordinates::BodyAt(xi.data());
    const Eigen::Vector3d h = body.mass * body.com;
    Eigen::Matrix4d J;
    J << Eigen::Matrix3d(SecondMoments(body.inertia) +
                         h * body.com.transpose()),
        h, h.transpose(), body.mass;
    return J;
  }
  static Eigen::VectorXd Coordinates(const Eigen::Matrix4d& J) {
    Eigen::VectorXd xi(10);
    const Eigen::Matrix3d S = J.topLeftCorner<3, 3>();
    const Eigen::Matrix3d I = S.trace() * Eigen::Matrix3d::Identity() - S;
    xi << J(3, 3), J(0, 3), J(1, 3), J(2, 3), I(0, 0), I(1, 1), I(2, 2),
        I(0, 1), I(0, 2), I(1, 2);
    return xi;
  }
  // (11.7) of the link with Knowing() rows.
  double Cost(const Eigen::VectorXd& xi, const Eigen::VectorXd& change,
              double weight) const {
    const Eigen::VectorXd xi0 = Xi0().head(10);
    const Eigen::Matrix4d J = PseudoInertia(xi);
    return 0.5 * std::pow(weight, 2) * (xi - xi0 - change).squaredNorm() +
           (PseudoInertia(xi0).inverse() * J).trace() -
           std::log(J.determinant());
  }
  const Model model_;
  const ShootingProblem problem_;
  const EquationCoordinates coordinates_;
};

TEST_F(EstimateTest, APossibleBodyIsFoundExactly) {
  Eigen::VectorXd change = 0.2 * Xi0();
  const RegressionEstimate found = Estimate(change, 1e6);
  EXPECT_TRUE(found.converged);
  EXPECT_LT((found.xi - Xi0() - change).norm(), 1e-6);
  // theta says the same.
  MechanismParameters<double> values;
  problem_.map().Apply<double>(found.theta.data(), &values);
  Eigen::VectorXd xi(coordinates_.size());
  coordinates_.Read<double>(values, xi.data());
  EXPECT_LT((xi - found.xi).norm(), 1e-9);
}

TEST_F(EstimateTest, AnImpossibleOneEndsInsideThePossible) {
  // A mass of -1 kg, and moments that no body has.
  Eigen::VectorXd change = Eigen::VectorXd::Zero(coordinates_.size());
  change[0] = -1.0 - Xi0()[0];
  change[4] = 1.0;
  const RegressionEstimate found = Estimate(change, 1e3);
  EXPECT_TRUE(found.converged);
  const Inertial<double> body = EquationCoordinates::BodyAt(
      found.xi.data() +
      coordinates_.PlaceOf(model_.mechanism().FindLink("link2")));
  EXPECT_GT(body.mass, 0.0);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> moments(
      SecondMoments(body.inertia));
  EXPECT_GT(moments.eigenvalues().minCoeff(), 0.0);
  // (11.7) grows in all directions, of which a body near the bound bears few.
  const Eigen::VectorXd at = found.xi.head(10);
  const double least = Cost(at, change.head(10), 1e3);
  const Eigen::Matrix4d L = PseudoInertia(at).llt().matrixL();
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Matrix4d random = Eigen::Matrix4d::Random();
    for (double size : {1e-2, -1e-2}) {
      const Eigen::Matrix4d S = size * (random + random.transpose());
      const Eigen::VectorXd there =
          Coordinates(L * (Eigen::Matrix4d::Identity() + S) * L.transpose());
      EXPECT_GE(Cost(there, change.head(10), 1e3), least - 1e-5) << trial;
    }
  }
}

TEST_F(EstimateTest, ABoundHoldsAndTheRestMovesOn) {
  Eigen::VectorXd change = 0.1 * Xi0();
  change[10] = -1.0;  // friction below zero
  const RegressionEstimate found = Estimate(change, 1e6);
  EXPECT_TRUE(found.converged);
  EXPECT_EQ(found.xi[10], 0.0);
  EXPECT_LT((found.xi - Xi0() - change).head(10).norm(), 1e-6);
}

TEST_F(EstimateTest, WhatTheRowsDoNotSeeStaysWithTheUrdf) {
  RowMatrixXd nothing = RowMatrixXd::Zero(1, coordinates_.size() + 1);
  const RegressionEstimate found = EstimateByRegression(
      problem_, coordinates_, nothing, problem_.InitialTheta());
  EXPECT_TRUE(found.converged);
  EXPECT_LT((found.xi - Xi0()).norm(), 1e-9);
}

// Wherever the search begins: an earlier estimate from the same data is no
// belief about the body.
TEST_F(EstimateTest, TheBodyOfTheUrdfCountsWhereverTheSearchBegins) {
  const RegressionEstimate moved = Estimate(0.2 * Xi0(), 1e6);
  RowMatrixXd nothing = RowMatrixXd::Zero(1, coordinates_.size() + 1);
  const RegressionEstimate found =
      EstimateByRegression(problem_, coordinates_, nothing, moved.theta);
  EXPECT_TRUE(found.converged);
  // The friction, of which nothing is known, stays where it was.
  EXPECT_LT((found.xi - Xi0()).head(10).norm(), 1e-3 * Xi0().head(10).norm());
}

// (11.18) is the second derivative of (11.8), along any change.
TEST_F(EstimateTest, TheCurvatureOfTheEntropyIsThatOfItsDifferences) {
  const Inertial<double>& body = model_.nominal().links[2];
  const Eigen::MatrixXd curvature = EntropyCurvature(body);
  ASSERT_EQ(curvature.rows(), 10);
  const Eigen::VectorXd xi0 = Xi0().head(10);
  const Eigen::Matrix4d inverse = PseudoInertia(xi0).inverse();
  const auto D = [&](const Eigen::VectorXd& xi) {
    const Eigen::Matrix4d M = inverse * PseudoInertia(xi);
    return M.trace() - std::log(M.determinant()) - 4.0;
  };
  for (int k = 0; k < 10; ++k) {
    // Each coordinate, and all at once.
    Eigen::VectorXd x =
        Eigen::VectorXd::Unit(10, k) / std::sqrt(curvature(k, k));
    if (k == 9) x = 0.3 * xi0;
    constexpr double kStep = 1e-3;
    const double second =
        (D(xi0 + kStep * x) - 2.0 * D(xi0) + D(xi0 - kStep * x)) /
        (kStep * kStep);
    const double expected = x.dot(curvature * x);
    EXPECT_NEAR(second, expected, 1e-4 * expected) << k;
  }
  EXPECT_EQ(EntropyCurvature(Inertial<double>()).size(), 0);
}

// The more a body of the URDF counts, the less of it the data moves.
TEST_F(EstimateTest, ABodyThatCountsMoreMovesLess) {
  const Eigen::VectorXd change = 0.2 * Xi0();
  const auto moved = [&](double body_weight) {
    EstimationOptions options = problem_.options();
    options.body_weight = body_weight;
    const ShootingProblem problem = problem_.With(options);
    const RegressionEstimate found = EstimateByRegression(
        problem, coordinates_, Knowing(change, 30.0), problem.InitialTheta());
    EXPECT_TRUE(found.converged);
    return (found.xi - Xi0()).head(10).norm();
  };
  EXPECT_LT(moved(1e4), 0.5 * moved(1e-2));
}

}  // namespace
}  // namespace sysid
