#include "residuals/channel_residual.h"

#include <gmock/gmock.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "models/state.h"
#include "tests/support/all_joints.h"
#include "tests/support/measured_run.h"
#include "tests/support/ridders.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// --- The contract of every residual -----------------------------------------

struct Case {
  std::string name;
  Channel channel;
  OrientationResidual orientation;
};

std::vector<Case> AllCases() {
  std::vector<Case> cases;
  for (const Channel& channel : EveryChannel(AllJoints())) {
    std::string name = channel.name;
    std::replace(name.begin(), name.end(), '.', '_');
    cases.push_back({name, channel, OrientationResidual::kHeading});
    if (channel.kind == ChannelKind::kOrientation) {
      cases.push_back(
          {name + "_rotation", channel, OrientationResidual::kRotation});
    }
  }
  return cases;
}

// The residual on one state, for a scalar.
template <typename T>
std::vector<T> Evaluate(const Model& model, const ChannelResidual& residual,
                        const T* x, const VectorXd& measured) {
  constexpr double kSentinel = 12345.0;
  Workspace<T> ws(model);
  ForwardKinematics<T>(&ws, x);
  const PredictedState<T> state{x, x + model.nq(), nullptr, &ws};
  std::vector<T> r(ResidualSize(residual) + 1, T(kSentinel));
  std::visit([&](const auto& f) { f(state, measured.data(), r.data()); },
             residual);
  EXPECT_TRUE(r.back() == T(kSentinel)) << "it writes more than its size";
  r.pop_back();
  return r;
}

class ChannelResidualTest : public testing::TestWithParam<Case> {
 protected:
  VectorXd Residual(const VectorXd& x, const VectorXd& measured) const {
    const std::vector<double> r =
        Evaluate<double>(model_, residual_, x.data(), measured);
    return Eigen::Map<const VectorXd>(r.data(), r.size());
  }
  VectorXd MeasuredAt(const VectorXd& x) const {
    return Measured(model_.mechanism(), GetParam().channel, x);
  }
  VectorXd RandomX(Random* random) const {
    const RandomState at(model_.mechanism(), random);
    VectorXd x(model_.state_size());
    x << at.q, at.qd;
    return x;
  }
  VectorXd Neutral() const {
    VectorXd x = VectorXd::Zero(model_.state_size());
    x.head(model_.nq()) = model_.mechanism().NeutralConfiguration();
    return x;
  }
  VectorXd Plus(const VectorXd& x, const VectorXd& dx) const {
    VectorXd out(x.size());
    BoxPlus<double>(model_, x.data(), dx.data(), out.data());
    return out;
  }
  // By the tangent of the state.
  MatrixXd Jacobian(const VectorXd& x0, const VectorXd& measured) const {
    const int tangent = model_.tangent_size();
    EXPECT_LE(tangent, 16);
    std::vector<Jet16> x(x0.begin(), x0.end()), dx(tangent);
    for (int i = 0; i < tangent; ++i) dx[i].v[i] = 1.0;
    BoxPlus<Jet16>(model_, x.data(), dx.data(), x.data());
    const std::vector<Jet16> r =
        Evaluate<Jet16>(model_, residual_, x.data(), measured);
    MatrixXd J(r.size(), tangent);
    for (size_t i = 0; i < r.size(); ++i) {
      J.row(i) = r[i].v.head(tangent).transpose();
    }
    return J;
  }
  void ExpectJetsEqualDifferences(const VectorXd& x,
                                  const VectorXd& measured) const {
    const MatrixXd J = Jacobian(x, measured);
    ASSERT_TRUE(J.allFinite());
    for (int column = 0; column < J.cols(); ++column) {
      const auto difference = RiddersDifference(
          [&](double h) {
            return Residual(
                Plus(x, h * VectorXd::Unit(model_.tangent_size(), column)),
                measured);
          },
          0.05);
      EXPECT_LT((J.col(column) - difference.value).norm(), 1e-9)
          << "column " << column;
    }
  }

  const Model model_{AllJoints()};
  const ChannelResidual residual_ = MakeChannelResidual(
      model_.mechanism(), GetParam().channel, GetParam().orientation);
};

TEST_P(ChannelResidualTest, IsZeroWhereThePredictionEqualsTheMeasurement) {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    const VectorXd x = i == 0 ? Neutral() : RandomX(&random);
    EXPECT_LT(Residual(x, MeasuredAt(x)).norm(), 1e-14);
  }
}

TEST_P(ChannelResidualTest, IsNotZeroElsewhere) {
  Random random(2);
  const VectorXd measured = MeasuredAt(RandomX(&random));
  EXPECT_GT(Residual(RandomX(&random), measured).norm(), 1e-2);
}

TEST_P(ChannelResidualTest, HasJetsEqualToDifferencesAtGenericPoints) {
  Random random(3);
  for (int i = 0; i < 5; ++i) {
    const VectorXd x = RandomX(&random);
    const VectorXd measured = MeasuredAt(RandomX(&random));
    ExpectJetsEqualDifferences(x, measured);
  }
}

TEST_P(ChannelResidualTest, HasJetsEqualToDifferencesWithoutAnyRotation) {
  ExpectJetsEqualDifferences(Neutral(), MeasuredAt(Neutral()));
  Random random(4);
  ExpectJetsEqualDifferences(Neutral(), MeasuredAt(RandomX(&random)));
}

TEST_P(ChannelResidualTest, HasJetsEqualToDifferencesWithoutAnyError) {
  Random random(5);
  for (int i = 0; i < 5; ++i) {
    const VectorXd x = RandomX(&random);
    ExpectJetsEqualDifferences(x, MeasuredAt(x));
  }
}

// A unit vector in the plane has two components and one degree of freedom.
TEST_P(ChannelResidualTest, HasAsManyDegreesOfFreedomAsItsDerivativeHasRank) {
  Random random(6);
  const VectorXd x = RandomX(&random);
  const MatrixXd J = Jacobian(x, MeasuredAt(RandomX(&random)));
  ASSERT_EQ(J.rows(), ResidualSize(residual_));
  const VectorXd s = Eigen::JacobiSVD<MatrixXd>(J).singularValues();
  EXPECT_EQ((s.array() > 1e-10 * s[0]).count(), ResidualDof(residual_));
}

TEST_P(ChannelResidualTest, IsTheSameForBothSignsOfAQuaternion) {
  if (GetParam().channel.kind != ChannelKind::kOrientation) return;
  Random random(7);
  for (int i = 0; i < 20; ++i) {
    VectorXd x = RandomX(&random);
    const VectorXd measured = MeasuredAt(RandomX(&random));
    const VectorXd r = Residual(x, measured);
    EXPECT_LT((Residual(x, -measured) - r).norm(), 1e-14);
    const Joint& joint = model_.mechanism().joints[GetParam().channel.target];
    x.segment<4>(joint.q_index) *= -1.0;
    EXPECT_LT((Residual(x, measured) - r).norm(), 1e-14);
  }
}

TEST_P(ChannelResidualTest, IsFiniteAtHalfATurn) {
  if (GetParam().channel.kind != ChannelKind::kOrientation &&
      GetParam().channel.kind != ChannelKind::kPosition) {
    return;
  }
  Random random(8);
  const VectorXd x = RandomX(&random);
  const Joint& joint = model_.mechanism().joints[GetParam().channel.target];
  for (const double turn : {M_PI, M_PI - 1e-9, M_PI + 1e-9}) {
    VectorXd dx = VectorXd::Zero(model_.tangent_size());
    dx[joint.v_index] = turn;
    const VectorXd measured = MeasuredAt(Plus(x, dx));
    EXPECT_TRUE(Residual(x, measured).allFinite());
    EXPECT_TRUE(Jacobian(x, measured).allFinite());
  }
}

// A rotation of the world that keeps the span of the axes that a channel sees:
// any where it sees all or none; of a plane, about its normal; of a line, about
// itself.
Eigen::Matrix3d TurnOfTheWorld(const Channel& channel, Random* random) {
  const Eigen::Quaterniond any = random->Rotation();
  const std::vector<int>& axes = channel.axes;
  if (axes.empty() || axes.size() == 3) return any.toRotationMatrix();
  const int about = axes.size() == 1 ? axes[0] : 3 - axes[0] - axes[1];
  const double angle = 2 * std::atan2(any.z(), any.w());
  return Eigen::AngleAxisd(angle, Vector3d::Unit(about)).toRotationMatrix();
}

// The whole mechanism turned and moved in the world, with what measures it.
TEST_P(ChannelResidualTest, KeepsItsNormWhenTheBaseIsTurned) {
  Random random(9);
  Mechanism turned = AllJoints();
  const Eigen::Matrix3d R = TurnOfTheWorld(GetParam().channel, &random);
  turned.joints[0].R_PJ = R * turned.joints[0].R_PJ;
  turned.nominal.joint_p[0] = R * turned.nominal.joint_p[0] + Vector3d(1, 2, 3);
  const Model turned_model(turned);
  const ChannelResidual turned_residual =
      MakeChannelResidual(turned, GetParam().channel, GetParam().orientation);
  for (int i = 0; i < 10; ++i) {
    const VectorXd x = RandomX(&random), y = RandomX(&random);
    const std::vector<double> r =
        Evaluate<double>(turned_model, turned_residual, x.data(),
                         Measured(turned, GetParam().channel, y));
    const double norm = Eigen::Map<const VectorXd>(r.data(), r.size()).norm();
    EXPECT_NEAR(norm, Residual(x, MeasuredAt(y)).norm(), 1e-13);
  }
}

INSTANTIATE_TEST_SUITE_P(Channels, ChannelResidualTest,
                         testing::ValuesIn(AllCases()),
                         [](const auto& info) { return info.param.name; });

// --- What each one is -------------------------------------------------------

Channel ChannelOf(const Mechanism& mechanism, const std::string& joint,
                  ChannelKind kind) {
  Channel channel;
  channel.kind = kind;
  channel.target = mechanism.FindJoint(joint);
  channel.name = joint;
  return channel;
}

double Norm(const Model& model, const ChannelResidual& residual,
            const VectorXd& x, const VectorXd& measured) {
  const auto r = Evaluate<double>(model, residual, x.data(), measured);
  return Eigen::Map<const VectorXd>(r.data(), r.size()).norm();
}

TEST(PlanarHeadingResidual, HasTheNormTwiceTheSineOfHalfTheError) {
  const Model model(AllJoints());
  const int q =
      model.mechanism().joints[model.mechanism().FindJoint("hinge")].q_index;
  const ChannelResidual residual = PlanarHeadingResidual{q};
  VectorXd x = VectorXd::Zero(model.state_size());
  x.head(model.nq()) = model.mechanism().NeutralConfiguration();
  for (double error = -7.0; error < 7.0; error += 0.37) {
    x[q] = 0.8 + error;
    EXPECT_NEAR(Norm(model, residual, x, VectorXd::Constant(1, 0.8)),
                2.0 * std::abs(std::sin(0.5 * error)), 1e-14);
  }
}

TEST(HeadingResidual, HasTheNormTwiceTheSineOfHalfTheAngleBetweenTheAxes) {
  const Model model(AllJoints());
  const Mechanism& mechanism = model.mechanism();
  const Channel channel =
      ChannelOf(mechanism, "ball", ChannelKind::kOrientation);
  const Joint& joint = mechanism.joints[channel.target];
  const ChannelResidual residual =
      MakeChannelResidual(mechanism, channel, OrientationResidual::kHeading);
  const Vector3d axis = LinkAxis(mechanism, joint.child_link);
  Random random(10);
  VectorXd x = VectorXd::Zero(model.state_size());
  x.head(model.nq()) = mechanism.NeutralConfiguration();
  for (double error = 0.0; error < M_PI; error += 0.21) {
    const Eigen::Quaterniond q = random.Rotation();
    x.segment<4>(joint.q_index) = q.coeffs();
    // Turned across the axis by the error, and by any twist about it.
    const Vector3d across = axis.cross(random.Direction()).normalized();
    const Eigen::Quaterniond measured =
        q * Exp<double>(error * across) *
        Exp<double>(random.Uniform(-3, 3) * axis);
    EXPECT_NEAR(Norm(model, residual, x, measured.coeffs()),
                2.0 * std::sin(0.5 * error), 1e-14);
  }
}

TEST(RotationResidual, HasTheNormOfTheAngleBetween) {
  const Model model(AllJoints());
  const Mechanism& mechanism = model.mechanism();
  const Channel channel =
      ChannelOf(mechanism, "ball", ChannelKind::kOrientation);
  const Joint& joint = mechanism.joints[channel.target];
  const ChannelResidual residual =
      MakeChannelResidual(mechanism, channel, OrientationResidual::kRotation);
  Random random(11);
  VectorXd x = VectorXd::Zero(model.state_size());
  x.head(model.nq()) = mechanism.NeutralConfiguration();
  for (double error = 0.0; error < M_PI; error += 0.21) {
    const Eigen::Quaterniond q = random.Rotation();
    x.segment<4>(joint.q_index) = q.coeffs();
    const Eigen::Quaterniond measured =
        q * Exp<double>(error * random.Direction());
    EXPECT_NEAR(Norm(model, residual, x, measured.coeffs()), error, 1e-13);
  }
}

TEST(MakeChannelResidual, ChoosesByChannelJointAndOption) {
  const Mechanism mechanism = AllJoints();
  const auto make = [&](const char* joint, ChannelKind kind,
                        OrientationResidual orientation =
                            OrientationResidual::kHeading) {
    return MakeChannelResidual(mechanism, ChannelOf(mechanism, joint, kind),
                               orientation);
  };
  EXPECT_TRUE(std::holds_alternative<PlanarHeadingResidual>(
      make("hinge", ChannelKind::kPosition)));
  EXPECT_TRUE(std::holds_alternative<PlanarHeadingResidual>(
      make("wheel", ChannelKind::kPosition)));
  EXPECT_TRUE(std::holds_alternative<PositionResidual>(
      make("slide", ChannelKind::kPosition)));
  EXPECT_TRUE(std::holds_alternative<HeadingResidual>(
      make("ball", ChannelKind::kOrientation)));
  EXPECT_TRUE(std::holds_alternative<RotationResidual>(
      make("ball", ChannelKind::kOrientation, OrientationResidual::kRotation)));
  EXPECT_TRUE(std::holds_alternative<VelocityResidual>(
      make("slide", ChannelKind::kVelocity)));
  EXPECT_TRUE(std::holds_alternative<AngularVelocityResidual>(
      make("ball", ChannelKind::kAngularVelocity)));
  Channel frame = ChannelOf(mechanism, "ball", ChannelKind::kFramePosition);
  for (const std::vector<int>& axes :
       {std::vector<int>{1}, {0, 2}, {0, 1, 2}}) {
    frame.axes = axes;
    const ChannelResidual residual =
        MakeChannelResidual(mechanism, frame, OrientationResidual::kHeading);
    EXPECT_EQ(ResidualSize(residual), axes.size());
    EXPECT_EQ(ResidualDof(residual), axes.size());
  }
}

TEST(ResidualUnit, IsThatOfTheMeasurement) {
  const Mechanism mechanism = AllJoints();
  const auto unit = [&](const char* joint, ChannelKind kind) {
    return ResidualUnit(mechanism, ChannelOf(mechanism, joint, kind));
  };
  EXPECT_EQ(unit("hinge", ChannelKind::kPosition), "rad");
  EXPECT_EQ(unit("hinge", ChannelKind::kVelocity), "rad/s");
  EXPECT_EQ(unit("slide", ChannelKind::kPosition), "m");
  EXPECT_EQ(unit("slide", ChannelKind::kVelocity), "m/s");
  EXPECT_EQ(unit("ball", ChannelKind::kOrientation), "rad");
  EXPECT_EQ(unit("ball", ChannelKind::kAngularVelocity), "rad/s");
  EXPECT_EQ(unit("ball", ChannelKind::kFramePosition), "m");
}

TEST(IsPositionLike, TellsPositionsFromVelocities) {
  EXPECT_TRUE(IsPositionLike(ChannelKind::kPosition));
  EXPECT_TRUE(IsPositionLike(ChannelKind::kOrientation));
  EXPECT_TRUE(IsPositionLike(ChannelKind::kFramePosition));
  EXPECT_FALSE(IsPositionLike(ChannelKind::kVelocity));
  EXPECT_FALSE(IsPositionLike(ChannelKind::kAngularVelocity));
}

}  // namespace
}  // namespace sysid
