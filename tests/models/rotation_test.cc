#include "models/math/rotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "models/dynamics.h"
#include "models/scalars.h"
#include "tests/support/random_mechanism.h"
#include "tests/support/ridders.h"

namespace sysid {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
using Vector1 = Eigen::Matrix<double, 1, 1>;
using Vector10 = Eigen::Matrix<double, 10, 1>;

constexpr double kPi = std::numbers::pi;

// The angle of the rotation between a and b, either sign of each.
double AngleBetween(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const Eigen::Quaterniond d = a.conjugate() * b;
  return 2.0 * std::atan2(d.vec().norm(), std::abs(d.w()));
}

// A body on a spherical joint at the world's origin, with a tip at (1, 0, 0).
Mechanism BallWithTip(const Inertial<double>& body) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  Joint ball;
  ball.name = "ball";
  ball.type = JointType::kSpherical;
  ball.parent_link = 0;
  mechanism.AddJoint(ball, "body", {0, 0, 0}, body);
  Joint mount;
  mount.name = "mount";
  mount.parent_link = 1;
  mechanism.AddJoint(mount, "tip", {1, 0, 0}, {});
  return mechanism;
}

Inertial<double> LopsidedBody() {
  Inertial<double> body;
  body.mass = 1.3;
  body.com = Eigen::Vector3d(0.2, -0.1, 0.3);
  body.inertia = Eigen::Vector3d(0.05, 0.08, 0.11).asDiagonal();
  return body;
}

Eigen::Vector3d TipAt(const Eigen::Vector4d& q) {
  const Model model(BallWithTip(LopsidedBody()));
  Workspace<double> ws(model);
  ForwardKinematics<double>(&ws, q.data());
  return LinkPosition<double>(ws, 2);
}

TEST(QuaternionConvention, KeepsXYZWInMemoryAndCarriesTheChildToTheParent) {
  // 90 degrees about z carry the tip (1, 0, 0) to (0, 1, 0). The inverse
  // carries it to (0, -1, 0), and w, x, y, z read as x, y, z, w to (0, 0, -1).
  const double h = std::sqrt(0.5);
  EXPECT_TRUE(TipAt({0, 0, h, h}).isApprox(Eigen::Vector3d(0, 1, 0), 1e-15));
  EXPECT_TRUE(TipAt({h, 0, 0, h}).isApprox(Eigen::Vector3d(1, 0, 0), 1e-15));
  EXPECT_TRUE(TipAt({0, h, 0, h}).isApprox(Eigen::Vector3d(0, 0, -1), 1e-15));
}

TEST(QuaternionConvention, BothSignsAreTheSameRotation) {
  const Eigen::Vector4d q = Eigen::Vector4d(0.1, -0.7, 0.3, 0.4).normalized();
  EXPECT_EQ(TipAt(q), TipAt(-q));
}

TEST(QuaternionConvention, IsHamilton) {
  const Eigen::Quaterniond i(0, 1, 0, 0), j(0, 0, 1, 0), k(0, 0, 0, 1);
  EXPECT_EQ(Multiply<double>(i, j).coeffs(), k.coeffs());
  EXPECT_EQ(Multiply<double>(j, k).coeffs(), i.coeffs());
  EXPECT_EQ(Multiply<double>(k, i).coeffs(), j.coeffs());
  EXPECT_EQ(Multiply<double>(i, i).coeffs(), Eigen::Vector4d(0, 0, 0, -1));
}

TEST(QuaternionConvention, ProductsOfQuaternionsAreProductsOfMatrices) {
  Random random(1);
  for (int n = 0; n < 100; ++n) {
    const Eigen::Quaterniond a = random.Rotation(), b = random.Rotation();
    const Eigen::Matrix3d product = ToMatrix<double>(Multiply<double>(a, b));
    EXPECT_LT((product - ToMatrix<double>(a) * ToMatrix<double>(b)).norm(),
              20 * kEpsilon);
    EXPECT_LT((ToMatrix<double>(a) - a.toRotationMatrix()).norm(),
              20 * kEpsilon);
    EXPECT_LT((Multiply<double>(a, b).coeffs() - (a * b).coeffs()).norm(),
              4 * kEpsilon);
  }
}

// qd of a spherical joint is in the child's axes: q(t + h) = q Exp(w h). Energy
// tells: the power of gravity in that motion is what RNEA must pay.
TEST(QuaternionConvention, AngularVelocityIsInTheChildsAxesOnTheRight) {
  const Model model(BallWithTip(LopsidedBody()));
  Workspace<double> ws(model);
  Random random(2);
  for (int n = 0; n < 10; ++n) {
    const Eigen::Quaterniond q = random.Rotation();
    const Eigen::Vector3d w = random.NormalVector(3);
    const auto right = RiddersDifference(
        [&](double h) -> Vector1 {
          const Eigen::Quaterniond moved =
              Multiply<double>(q, Exp<double>(Eigen::Vector3d(w * h)));
          return Vector1(PotentialEnergy(&ws, moved.coeffs().data()));
        },
        0.1);
    const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
    Eigen::Vector3d tau;
    InverseDynamics<double>(&ws, q.coeffs().data(), zero.data(), zero.data(),
                            tau.data());
    // 1e-11: what Ridders' differences of numbers of order 10 give.
    EXPECT_NEAR(tau.dot(w), right.value[0], 1e-11);
    // On the left the same numbers are another motion: the test can fail.
    const Eigen::Vector3d other = q.conjugate() * w;
    EXPECT_GT(std::abs(tau.dot(other) - right.value[0]), 1e-3);
  }
}

TEST(QuaternionConvention, KineticEnergyOfASpinIsThatOfTheBodysAxes) {
  const Inertial<double> body = LopsidedBody();
  const Model model(BallWithTip(body));
  Workspace<double> ws(model);
  const Eigen::Vector3d w(1.0, -2.0, 0.5);
  const double expected = 0.5 * w.dot(body.inertia * w) +
                          0.5 * body.mass * w.cross(body.com).squaredNorm();
  Random random(3);
  for (int n = 0; n < 10; ++n) {
    const Eigen::Quaterniond q = random.Rotation();
    EXPECT_NEAR(KineticEnergy(&ws, q.coeffs().data(), w.data()), expected,
                20 * kEpsilon);
  }
}

TEST(Exp, IsTheRotationAboutTheAxisByTheAngle) {
  Random random(4);
  for (int n = 0; n < 200; ++n) {
    const Eigen::Vector3d axis = random.Direction();
    const double angle = random.Uniform(0.0, 2.0 * kPi);
    const Eigen::Quaterniond q = Exp<double>(Eigen::Vector3d(axis * angle));
    const Eigen::Quaterniond expected(Eigen::AngleAxisd(angle, axis));
    EXPECT_LT((q.coeffs() - expected.coeffs()).norm(), 8 * kEpsilon);
  }
}

// On both sides of the thresholds between series and closed form, against long
// double.
TEST(Exp, IsExactForAnglesOfEverySize) {
  const Eigen::Vector3d axis = Eigen::Vector3d(2, -3, 6) / 7.0;
  for (double angle = 1e-200; angle < 6.0; angle *= 1.7) {
    const Eigen::Quaterniond q = Exp<double>(Eigen::Vector3d(axis * angle));
    const long double half = 0.5L * angle;
    const double s = static_cast<double>(std::sin(half));
    EXPECT_LT((q.vec() - axis * s).norm(), 4 * kEpsilon * std::abs(s)) << angle;
    EXPECT_NEAR(q.w(), static_cast<double>(std::cos(half)), 2 * kEpsilon)
        << angle;
  }
}

TEST(Log, UndoesExpForAnglesOfEverySize) {
  const Eigen::Vector3d axis = Eigen::Vector3d(2, -3, 6) / 7.0;
  for (double angle = 1e-200; angle < kPi; angle *= 1.3) {
    const Eigen::Vector3d phi = axis * angle;
    const Eigen::Vector3d back = Log<double>(Exp<double>(phi));
    // Near pi the cosine of half the angle is small and its rounding counts
    // once more; 8 covers both.
    EXPECT_LT((back - phi).norm(), 8 * kEpsilon * angle) << angle;
  }
}

TEST(Log, UndoesExpUpToTheHalfTurnAndTakesTheShortWayBeyond) {
  const Eigen::Vector3d axis = Eigen::Vector3d(2, -3, 6) / 7.0;
  for (const double gap : {1e-1, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15}) {
    const Eigen::Vector3d below = axis * (kPi - gap);
    EXPECT_LT((Log<double>(Exp<double>(below)) - below).norm(), 16 * kEpsilon)
        << gap;
    if (gap < 1e-14) continue;  // kPi + 1e-15 rounds to the half turn
    const Eigen::Vector3d above = axis * (kPi + gap);
    const Eigen::Vector3d short_way = axis * (gap - kPi);
    EXPECT_LT((Log<double>(Exp<double>(above)) - short_way).norm(),
              16 * kEpsilon)
        << gap;
  }
}

TEST(Log, NeverExceedsAHalfTurnAndIsBlindToTheSign) {
  Random random(5);
  for (int n = 0; n < 1000; ++n) {
    const Eigen::Quaterniond q = random.Rotation();
    const Eigen::Quaterniond minus(Eigen::Vector4d(-q.coeffs()));
    EXPECT_LE(Log<double>(q).norm(), kPi * (1 + 2 * kEpsilon));
    EXPECT_EQ(Log<double>(q), Log<double>(minus));
    EXPECT_LT(AngleBetween(Exp<double>(Log<double>(q)), q), 8 * kEpsilon);
  }
}

TEST(Log, OfTheHalfTurnItselfIsAHalfTurn) {
  const Eigen::Quaterniond q(0, 0, 1, 0);
  EXPECT_NEAR(Log<double>(q).norm(), kPi, 2 * kEpsilon);
  EXPECT_NEAR(std::abs(Log<double>(q).y()), kPi, 2 * kEpsilon);
}

// J_r(u)^-1 w = d/dh Log(Exp(u) Exp(w h)) at h = 0; the code keeps terms up to
// u^2 and the next one is -|u|^4/720 of w's part across u, so that the
// remainder is below |u|^4/720 (1 + |u|^2/10) |w|. The left Jacobian's inverse
// is off by u x w.
TEST(RightJacobianInverse, MatchesDifferencesToItsOrder) {
  Random random(6);
  for (const double angle : {0.0, 1e-3, 0.1, 0.2, 0.4}) {
    for (int n = 0; n < 10; ++n) {
      const Eigen::Vector3d u = random.Direction() * angle;
      const Eigen::Vector3d w = random.NormalVector(3);
      const auto exact = RiddersDifference(
          [&](double h) -> Eigen::Vector3d {
            return Log<double>(Multiply<double>(
                Exp<double>(u), Exp<double>(Eigen::Vector3d(w * h))));
          },
          0.05);
      const double remainder =
          std::pow(angle, 4) / 720.0 * (1.0 + angle * angle / 10.0) * w.norm();
      EXPECT_LE((RightJacobianInverse<double>(u, w) - exact.value).norm(),
                remainder + 1e-11)  // rounding of the differences
          << angle;
    }
  }
}

TEST(RightJacobianInverse, NeglectsAFourthOrderTermAndNoLowerOne) {
  const Eigen::Vector3d direction = Eigen::Vector3d(2, -3, 6) / 7.0;
  const Eigen::Vector3d w(1.0, 2.0, -0.5);
  const auto error = [&](double angle) {
    const Eigen::Vector3d u = direction * angle;
    const auto exact = RiddersDifference(
        [&](double h) -> Eigen::Vector3d {
          return Log<double>(Multiply<double>(
              Exp<double>(u), Exp<double>(Eigen::Vector3d(w * h))));
        },
        0.05);
    return (RightJacobianInverse<double>(u, w) - exact.value).norm();
  };
  // 16, and 4 % for the term after it.
  EXPECT_NEAR(error(0.4) / error(0.2), 16.0, 0.64);
}

using J = Jet8;

Vector3<J> Seeded(const Eigen::Vector3d& x) {
  return Vector3<J>(J(x[0], 0), J(x[1], 1), J(x[2], 2));
}

Eigen::Matrix3d Derivative(const Vector3<J>& x) {
  Eigen::Matrix3d D;
  for (int i = 0; i < 3; ++i) D.row(i) = x[i].v.head<3>().transpose();
  return D;
}

TEST(RotationJets, AreFiniteAndRightAtZero) {
  const Quaternion<J> q = Exp<J>(Seeded(Eigen::Vector3d::Zero()));
  EXPECT_EQ(Derivative(q.vec()), 0.5 * Eigen::Matrix3d::Identity());
  EXPECT_EQ(q.w().a, 1.0);
  EXPECT_EQ(q.w().v.norm(), 0.0);
  const Vector3<J> back = Log<J>(q);
  EXPECT_EQ(Derivative(back), Eigen::Matrix3d::Identity());
  const Quaternion<J> identity(J(1.0), J(0.0, 0), J(0.0, 1), J(0.0, 2));
  EXPECT_EQ(Derivative(Log<J>(identity)), 2.0 * Eigen::Matrix3d::Identity());
  const Vector3<J> w(J(1.0), J(2.0), J(3.0));
  const Vector3<J> rate =
      RightJacobianInverse<J>(Seeded(Eigen::Vector3d::Zero()), w);
  // d(u x w)/du / 2 = -[w]x / 2.
  EXPECT_EQ(Derivative(rate), -0.5 * Skew<double>(Eigen::Vector3d(1, 2, 3)));
}

TEST(RotationJets, MatchDifferencesOnBothSidesOfTheSeries) {
  Random random(7);
  for (const double angle :
       {1e-8, 1e-4, 1.9e-3, 2.1e-3, 9.9e-3, 1.01e-2, 0.3, 1.0, 2.0, 3.0, 4.0}) {
    const Eigen::Vector3d phi = random.Direction() * angle;
    const Quaternion<J> q = Exp<J>(Seeded(phi));
    const Eigen::Quaterniond offset = random.Rotation();
    const Vector3<J> log = Log<J>(Multiply<J>(offset.cast<J>(), q));
    const Vector3<J> round = Log<J>(q);
    for (int k = 0; k < 3; ++k) {
      const auto d = RiddersDifference(
          [&](double h) -> Vector10 {
            const Eigen::Quaterniond moved = Exp<double>(
                Eigen::Vector3d(phi + h * Eigen::Vector3d::Unit(k)));
            const Eigen::Vector3d log =
                Log<double>(Multiply<double>(offset, moved));
            const Eigen::Vector3d round = Log<double>(moved);
            return Vector10{moved.x(), moved.y(), moved.z(), moved.w(),
                            log[0],    log[1],    log[2],    round[0],
                            round[1],  round[2]};
          },
          0.02);
      Vector10 jets;
      for (int i = 0; i < 4; ++i) jets[i] = q.coeffs()[i].v[k];
      for (int i = 0; i < 3; ++i) jets[4 + i] = log[i].v[k];
      for (int i = 0; i < 3; ++i) jets[7 + i] = round[i].v[k];
      // Rounding of the differences: epsilon over the smallest step, 1e-3,
      // times the tableau's amplification.
      EXPECT_LT((jets - d.value).cwiseAbs().maxCoeff(), 1e-11) << angle;
    }
  }
}

TEST(RotationJets, HaveTheValuesOfDoubles) {
  Random random(8);
  for (int n = 0; n < 100; ++n) {
    const Eigen::Vector3d phi = random.NormalVector(3);
    const Quaternion<J> jets = Exp<J>(Seeded(phi));
    const Eigen::Quaterniond plain = Exp<double>(phi);
    for (int i = 0; i < 4; ++i) {
      EXPECT_NEAR(jets.coeffs()[i].a, plain.coeffs()[i], 2 * kEpsilon);
    }
  }
}

}  // namespace
}  // namespace sysid
