#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "tests/support/dynamics_calls.h"
#include "tests/support/random_mechanism.h"

namespace sysid {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

// Textbook equations of motion against ForwardDynamics.

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

TEST(ForwardDynamics, MatchesThePendulum) {
  constexpr double kMass = 1.3, kLength = 0.7, kMoment = 0.05;
  Mechanism mechanism;
  mechanism.AddRoot("root");
  mechanism.AddJoint(
      MakeJoint("joint1", JointType::kRevolute, 0, Vector3d::UnitY()), "link1",
      {0.1, 0.2, 0.3}, Body(kMass, {0, 0, -kLength}, {0.09, kMoment, 0.08}));
  const Model model(mechanism);
  Workspace<double> ws(model);
  const double inertia = kMoment + kMass * kLength * kLength;
  for (double q = -4.0; q < 4.0; q += 0.37) {
    const double expected =
        (0.4 - kMass * 9.81 * kLength * std::sin(q)) / inertia;
    const VectorXd qdd =
        Forward(&ws, VectorXd::Constant(1, q), VectorXd::Constant(1, 2.0),
                VectorXd::Constant(1, 0.4));
    EXPECT_NEAR(qdd[0], expected, 20 * kEpsilon * 9.81 / kLength);
  }
}

// Euler's equation about the pivot, in body axes:
// I_o wd + w x I_o w = tau + c x m R^T g.
TEST(ForwardDynamics, MatchesTheSphericalPendulum) {
  const Inertial<double> body = Body(0.8, {0.1, -0.3, 0.2}, {0.05, 0.06, 0.07});
  Mechanism mechanism;
  mechanism.AddRoot("root");
  mechanism.AddJoint(
      MakeJoint("joint1", JointType::kSpherical, 0, Vector3d::UnitZ()), "link1",
      {0.1, 0.2, 0.3}, body);
  const Model model(mechanism);
  Workspace<double> ws(model);
  const Eigen::Matrix3d about_pivot =
      body.inertia +
      body.mass * (body.com.squaredNorm() * Eigen::Matrix3d::Identity() -
                   body.com * body.com.transpose());
  Random random(1);
  for (int n = 0; n < 50; ++n) {
    const RandomState x(mechanism, &random);
    const Vector3d w = x.qd, tau = x.tau;
    const Eigen::Quaterniond q(Eigen::Vector4d(x.q));
    const Vector3d weight = q.conjugate() * Vector3d(0, 0, -9.81 * body.mass);
    const Vector3d expected =
        about_pivot.inverse() *
        (tau + body.com.cross(weight) - w.cross(Vector3d(about_pivot * w)));
    EXPECT_LT((Forward(&ws, x.q, x.qd, x.tau) - expected).norm(),
              200 * kEpsilon * expected.norm());
  }
}

// Cart of mass M along x, pole of mass m hanging at distance l, moment I about
// its centre, angle q about y (its centre is at x - l sin q, -l cos q):
//   (M + m) xdd - m l cos(q) qdd + m l sin(q) qd^2 = F
//   (I + m l^2) qdd - m l cos(q) xdd + m g l sin(q) = tau.
TEST(ForwardDynamics, MatchesTheCartPole) {
  constexpr double kCart = 2.0, kMass = 0.6, kLength = 0.4, kMoment = 0.02;
  Mechanism mechanism;
  mechanism.AddRoot("root");
  mechanism.AddJoint(
      MakeJoint("cart", JointType::kPrismatic, 0, Vector3d::UnitX()), "cart",
      {0, 0, 0.5}, Body(kCart, {0.1, 0.2, 0.3}, {1, 1, 1}));
  mechanism.AddJoint(
      MakeJoint("pole", JointType::kContinuous, 1, Vector3d::UnitY()), "pole",
      {0, 0, 0.2}, Body(kMass, {0, 0, -kLength}, {0.03, kMoment, 0.04}));
  const Model model(mechanism);
  Workspace<double> ws(model);
  Random random(2);
  for (int n = 0; n < 50; ++n) {
    const RandomState x(mechanism, &random);
    const double s = std::sin(x.q[1]), c = std::cos(x.q[1]);
    const double ml = kMass * kLength;
    Eigen::Matrix2d M;
    M << kCart + kMass, -ml * c, -ml * c, kMoment + ml * kLength;
    const Eigen::Vector2d rhs(x.tau[0] - ml * s * x.qd[1] * x.qd[1],
                              x.tau[1] - ml * 9.81 * s);
    const Eigen::Vector2d expected = M.inverse() * rhs;
    const VectorXd qdd = Forward(&ws, x.q, x.qd, x.tau);
    EXPECT_LT((qdd - expected).norm(), 200 * kEpsilon * (1 + expected.norm()));
  }
}

TEST(ForwardDynamics, MatchesASlideUpAnIncline) {
  const Vector3d axis = Vector3d(2, 3, 6) / 7.0;
  Mechanism mechanism;
  mechanism.AddRoot("root");
  mechanism.AddJoint(MakeJoint("slide", JointType::kPrismatic, 0, axis), "car",
                     {0, 0, 0}, Body(4.0, {0.1, 0.2, 0.3}, {1, 1, 1}));
  const Model model(mechanism);
  Workspace<double> ws(model);
  const VectorXd qdd =
      Forward(&ws, VectorXd::Constant(1, 0.3), VectorXd::Constant(1, -1.0),
              VectorXd::Constant(1, 10.0));
  EXPECT_NEAR(qdd[0], 10.0 / 4.0 - 9.81 * 6.0 / 7.0, 20 * kEpsilon);
}

// A slide on a turning arm: rdd = r qd^2 + F / m and
// (I + m r^2) qdd + 2 m r rd qd = tau, in the horizontal plane.
TEST(ForwardDynamics, HasCentrifugalAndCoriolisForcesOnASlide) {
  constexpr double kMass = 0.5, kMoment = 0.3;
  Mechanism mechanism;
  mechanism.AddRoot("root");
  mechanism.AddJoint(
      MakeJoint("turn", JointType::kRevolute, 0, Vector3d::UnitZ()), "arm",
      {0, 0, 0}, Body(1.0, {0, 0, 0}, {1, 1, kMoment}));
  mechanism.AddJoint(
      MakeJoint("slide", JointType::kPrismatic, 1, Vector3d::UnitX()), "bead",
      {0, 0, 0}, Body(kMass, {0, 0, 0}, {0, 0, 0}));
  const Model model(mechanism);
  Workspace<double> ws(model);
  const Eigen::Vector2d q(0.4, 0.8), qd(1.5, -0.6), tau(0.2, 0.1);
  const VectorXd qdd = Forward(&ws, q, qd, tau);
  EXPECT_NEAR(qdd[1], q[1] * qd[0] * qd[0] + tau[1] / kMass, 20 * kEpsilon);
  EXPECT_NEAR(qdd[0],
              (tau[0] - 2 * kMass * q[1] * qd[1] * qd[0]) /
                  (kMoment + kMass * q[1] * q[1]),
              20 * kEpsilon);
}

}  // namespace
}  // namespace sysid
