#include "sysid/estimation/initial_states.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "models/math/rotation.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

using Eigen::Vector3d;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Samples at 100 Hz of the given channels' motions.
template <class F>
Channel MakeChannel(const Model& model, ChannelKind kind,
                    const std::string& target, const std::vector<double>& t,
                    int columns, const F& at) {
  Channel channel;
  channel.kind = kind;
  channel.name = target;
  channel.target = kind == ChannelKind::kFramePosition
                       ? model.mechanism().FindLink(target)
                       : model.mechanism().FindJoint(target);
  EXPECT_GE(channel.target, 0);
  if (kind == ChannelKind::kFramePosition) channel.axes = {0, 1, 2};
  channel.values.resize(t.size(), columns);
  for (size_t k = 0; k < t.size(); ++k) {
    const auto value = at(t[k]);
    for (int c = 0; c < columns; ++c) channel.values(k, c) = value[c];
  }
  return channel;
}

sysid::Run EmptyRun(const Model& model, double duration = 2.0,
                    double rate = 100.0) {
  sysid::Run run;
  run.name = "run.csv";
  for (int k = 0; k <= std::lround(duration * rate); ++k) {
    run.t.push_back(1.0 + k / rate);
  }
  run.effort.setZero(run.size(), model.nv());
  return run;
}

std::array<double, 1> One(double value) { return {value}; }

RowMatrixXd States(const Model& model, const sysid::Run& run) {
  const ShootingProblem problem(model, {}, {run}, {});
  return StatesFromData(problem, 0);
}

TEST(StatesFromData, HaveTheVelocitiesOfAKnownMotion) {
  const Model model = Shipped("cartpole");
  sysid::Run run = EmptyRun(model);
  const auto slide = [](double t) { return One(0.4 * std::sin(3.0 * t)); };
  const auto angle = [](double t) { return One(0.8 * std::cos(5.0 * t)); };
  run.channels = {
      MakeChannel(model, ChannelKind::kPosition, "slider", run.t, 1, slide),
      MakeChannel(model, ChannelKind::kPosition, "hinge", run.t, 1, angle)};
  const RowMatrixXd states = States(model, run);
  ASSERT_EQ(states.rows(), run.size());
  ASSERT_EQ(states.cols(), model.state_size());
  for (int k = 0; k < run.size(); ++k) {
    const double t = run.t[k];
    // At the ends the window is one-sided.
    const bool inside = k >= 5 && k + 5 < run.size();
    const double fine = inside ? 1e-3 : 0.2;
    EXPECT_NEAR(states(k, 0), 0.4 * std::sin(3.0 * t), 1e-3);
    EXPECT_NEAR(states(k, 1), 0.8 * std::cos(5.0 * t), 1e-3);
    EXPECT_NEAR(states(k, 2), 1.2 * std::cos(3.0 * t), fine);
    EXPECT_NEAR(states(k, 3), -4.0 * std::sin(5.0 * t), 3 * fine);
  }
}

TEST(StatesFromData, PassOverSpikes) {
  const Model model = Shipped("cartpole");
  sysid::Run run = EmptyRun(model);
  const auto angle = [](double t) { return One(0.8 * std::cos(5.0 * t)); };
  run.channels = {
      MakeChannel(model, ChannelKind::kPosition, "hinge", run.t, 1, angle)};
  for (int k = 9; k + 9 < run.size(); k += 17) {
    run.channels[0].values(k, 0) += 1.0;
  }
  const RowMatrixXd states = States(model, run);
  for (int k = 0; k < run.size(); ++k) {
    EXPECT_NEAR(states(k, 1), 0.8 * std::cos(5.0 * run.t[k]), 0.02) << k;
  }
}

TEST(StatesFromData, UnwrapAngles) {
  const Model model = Shipped("pendulum1");
  const Model planar = Shipped("cartpole");
  sysid::Run run = EmptyRun(planar);
  run.channels = {MakeChannel(
      planar, ChannelKind::kPosition, "hinge", run.t, 1,
      [](double t) { return One(std::remainder(7.0 * t, 2 * M_PI)); })};
  const RowMatrixXd states = States(planar, run);
  for (int k = 0; k < run.size(); ++k) {
    EXPECT_NEAR(states(k, 3), 7.0, 1e-9);
    EXPECT_NEAR(std::remainder(states(k, 1) - 7.0 * run.t[k], 2 * M_PI), 0.0,
                1e-9);
  }
}

TEST(StatesFromData, HaveABodysAngularVelocityWhateverTheSigns) {
  const Model model = Shipped("pendulum1");
  ASSERT_EQ(model.nv(), 3);
  sysid::Run run = EmptyRun(model);
  const Vector3d w(1.0, -2.0, 3.0);
  const Eigen::Quaterniond q0 = Exp<double>(Vector3d(0.3, 0.4, -0.5));
  int sample = 0;
  run.channels = {MakeChannel(
      model, ChannelKind::kOrientation, "joint1", run.t, 4, [&](double t) {
        const Eigen::Quaterniond q = q0 * Exp<double>(w * t);
        return Eigen::Vector4d(++sample % 3 == 0 ? -q.coeffs() : q.coeffs());
      })};
  const RowMatrixXd states = States(model, run);
  for (int k = 0; k < run.size(); ++k) {
    const Eigen::Quaterniond q(
        Eigen::Vector4d(states.row(k).head<4>().transpose()));
    const Eigen::Quaterniond truth = q0 * Exp<double>(w * run.t[k]);
    EXPECT_NEAR(q.norm(), 1.0, 1e-12);
    EXPECT_LT(Log(truth.conjugate() * q).norm(), 1e-9);
    EXPECT_LT((states.row(k).tail<3>().transpose() - w).norm(), 1e-8);
  }
}

TEST(StatesFromData, SmoothNoise) {
  const Model model = Shipped("cartpole");
  sysid::Run run = EmptyRun(model, 20.0);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0.0, 1e-3);
  run.channels = {MakeChannel(
      model, ChannelKind::kPosition, "hinge", run.t, 1,
      [&](double t) { return One(std::sin(2.0 * t) + normal(random)); })};
  const RowMatrixXd states = States(model, run);
  double squares = 0.0, rate_squares = 0.0;
  for (int k = 0; k < run.size(); ++k) {
    const double e = states(k, 1) - std::sin(2.0 * run.t[k]);
    const double rate = states(k, 3) - 2.0 * std::cos(2.0 * run.t[k]);
    squares += e * e;
    rate_squares += rate * rate;
  }
  EXPECT_LT(std::sqrt(squares / run.size()), 0.6e-3);
  // A difference of neighbours would have 0.14.
  EXPECT_LT(std::sqrt(rate_squares / run.size()), 0.07);
}

TEST(StatesFromData, BridgeGapsAndHoldTheEnds) {
  const Model model = Shipped("cartpole");
  sysid::Run run = EmptyRun(model);
  run.channels = {MakeChannel(model, ChannelKind::kPosition, "slider", run.t, 1,
                              [](double t) { return One(0.5 * t); })};
  Eigen::Ref<RowMatrixXd> values = run.channels[0].values;
  values.topRows(10).setConstant(kNaN);
  values.middleRows(80, 40).setConstant(kNaN);
  values.bottomRows(5).setConstant(kNaN);
  const RowMatrixXd states = States(model, run);
  EXPECT_TRUE(states.allFinite());
  for (int k = 10; k < run.size() - 5; ++k) {
    EXPECT_NEAR(states(k, 0), 0.5 * run.t[k], 1e-9);
    EXPECT_NEAR(states(k, 2), 0.5, 1e-9);
  }
  EXPECT_NEAR(states(0, 0), 0.5 * run.t[10], 1e-9);
  EXPECT_EQ(states(0, 2), 0.0);
  EXPECT_NEAR(states(run.size() - 1, 0), 0.5 * run.t[run.size() - 6], 1e-9);
}

TEST(StatesFromData, BridgeGapsOfRotationsOnTheGroup) {
  const Model model = Shipped("pendulum1");
  sysid::Run run = EmptyRun(model);
  const Vector3d w(0.2, -0.5, 1.0);
  run.channels = {MakeChannel(
      model, ChannelKind::kOrientation, "joint1", run.t, 4,
      [&](double t) { return Eigen::Vector4d(Exp<double>(w * t).coeffs()); })};
  run.channels[0].values.middleRows(60, 50).setConstant(kNaN);
  const RowMatrixXd states = States(model, run);
  for (int k = 0; k < run.size(); ++k) {
    const Eigen::Quaterniond q(
        Eigen::Vector4d(states.row(k).head<4>().transpose()));
    EXPECT_LT(Log(Exp<double>(w * run.t[k]).conjugate() * q).norm(), 1e-9);
  }
}

TEST(StatesFromData, AreNeutralWhereNothingIsMeasured) {
  const Model model = Shipped("cartpole");
  sysid::Run run = EmptyRun(model);
  run.channels = {MakeChannel(model, ChannelKind::kPosition, "slider", run.t, 1,
                              [](double t) { return One(0.5 * t); }),
                  MakeChannel(model, ChannelKind::kPosition, "hinge", run.t, 1,
                              [](double) { return One(kNaN); })};
  const RowMatrixXd states = States(model, run);
  EXPECT_EQ(states.col(1), Eigen::VectorXd::Zero(run.size()));
  EXPECT_EQ(states.col(3), Eigen::VectorXd::Zero(run.size()));
}

TEST(StatesFromData, IntegrateAVelocityThatIsMeasuredAlone) {
  const Model model = Shipped("cartpole");
  sysid::Run run = EmptyRun(model);
  run.channels = {MakeChannel(model, ChannelKind::kVelocity, "hinge", run.t, 1,
                              [](double t) { return One(std::sin(t)); })};
  const RowMatrixXd states = States(model, run);
  for (int k = 0; k < run.size(); ++k) {
    EXPECT_NEAR(states(k, 1), std::cos(run.t[0]) - std::cos(run.t[k]), 1e-4);
    EXPECT_EQ(states(k, 3), std::sin(run.t[k]));
  }
}

// p of the tip of a chain of links of 0.5 m in the x-z plane that hangs at
// zero; a rotation about y by q takes -z to (-sin q, 0, -cos q).
std::array<double, 3> Tip(double q1, double q2) {
  return {-0.5 * std::sin(q1) - 0.5 * std::sin(q1 + q2), 0.0,
          -0.5 * std::cos(q1) - 0.5 * std::cos(q1 + q2)};
}

TEST(StatesFromData, FindAJointThatOnlyAFrameSees) {
  const Model model = Shipped("pendulum2_planar");
  sysid::Run run = EmptyRun(model);
  const auto q1 = [](double t) { return 0.4 * std::sin(2.0 * t); };
  const auto q2 = [](double t) { return 0.7 + 0.5 * std::cos(3.0 * t); };
  run.channels = {MakeChannel(model, ChannelKind::kPosition, "joint1", run.t, 1,
                              [&](double t) { return One(q1(t)); }),
                  MakeChannel(model, ChannelKind::kFramePosition, "tip", run.t,
                              3, [&](double t) { return Tip(q1(t), q2(t)); })};
  const RowMatrixXd states = States(model, run);
  for (int k = 6; k + 6 < run.size(); ++k) {
    EXPECT_NEAR(states(k, 1), q2(run.t[k]), 2e-3);
    EXPECT_NEAR(states(k, 3), -1.5 * std::sin(3.0 * run.t[k]), 2e-2);
  }
}

// As a camera does, whose plane is that of the motion.
TEST(StatesFromData, FindAJointThatAFrameSeesInAPlane) {
  const Model model = Shipped("pendulum2_planar");
  const auto q1 = [](double t) { return 0.4 * std::sin(2.0 * t); };
  const auto q2 = [](double t) { return 0.7 + 0.5 * std::cos(3.0 * t); };
  sysid::Run run = EmptyRun(model);
  run.channels = {MakeChannel(model, ChannelKind::kPosition, "joint1", run.t, 1,
                              [&](double t) { return One(q1(t)); }),
                  MakeChannel(model, ChannelKind::kFramePosition, "tip", run.t,
                              2, [&](double t) {
                                const std::array<double, 3> p =
                                    Tip(q1(t), q2(t));
                                return std::array<double, 2>{p[0], p[2]};
                              })};
  run.channels[1].axes = {0, 2};
  const RowMatrixXd states = States(model, run);
  for (int k = 6; k + 6 < run.size(); ++k) {
    EXPECT_NEAR(states(k, 1), q2(run.t[k]), 2e-3);
  }
}

TEST(StatesFromData, FindASphericalJointThatOnlyAFrameSees) {
  const Model model = Shipped("pendulum1");
  sysid::Run run = EmptyRun(model);
  const Vector3d down(0, 0, -0.5);
  const auto tip = [&](double t) {
    return Vector3d(
        Exp<double>(Vector3d(0.5 * std::sin(2 * t), 0.3 * std::cos(3 * t), 0)) *
        down);
  };
  run.channels = {
      MakeChannel(model, ChannelKind::kFramePosition, "tip", run.t, 3, tip)};
  const RowMatrixXd states = States(model, run);
  for (int k = 6; k + 6 < run.size(); ++k) {
    const Eigen::Quaterniond q(
        Eigen::Vector4d(states.row(k).head<4>().transpose()));
    EXPECT_LT((q * down - tip(run.t[k])).norm(), 1e-3);
    // The tip's velocity, whatever the spin about the rod.
    const Vector3d v = q * states.row(k).tail<3>().transpose().cross(down);
    const double h = 1e-5;
    const Vector3d v_true = (tip(run.t[k] + h) - tip(run.t[k] - h)) / (2 * h);
    EXPECT_LT((v - v_true).norm(), 0.02);
  }
}

// Along the smoothed way; a motor as fast as its joint, bent by the effort.
TEST(StatesFromData, SayWhatEffectsRemember) {
  const Model model = Shipped(
      "cartpole", {"presliding_friction@slider", "joint_elasticity@hinge"},
      {{"slider.presliding_length", 0.1}, {"hinge.drive_stiffness", 50.0}});
  sysid::Run run = EmptyRun(model);
  run.effort.col(1).setConstant(2.0);
  const auto slide = [](double t) { return One(0.4 * std::sin(3.0 * t)); };
  const auto angle = [](double t) { return One(0.8 * std::cos(5.0 * t)); };
  run.channels = {
      MakeChannel(model, ChannelKind::kPosition, "slider", run.t, 1, slide),
      MakeChannel(model, ChannelKind::kPosition, "hinge", run.t, 1, angle)};
  const RowMatrixXd states = States(model, run);
  const int z = model.layout().z();
  double bend = 0.0;
  for (int k = 0; k < run.size(); ++k) {
    EXPECT_NEAR(states(k, z), bend, 0.02) << run.t[k];
    EXPECT_NEAR(states(k, z + 1), 2.0 / 50.0, 1e-12);
    EXPECT_EQ(states(k, z + 2), states(k, model.layout().qd() + 1));
    if (k + 1 == run.size()) break;
    // Dahl's equation, by small steps to the next sample.
    constexpr int kParts = 100;
    for (int i = 0; i < kParts; ++i) {
      const double h = (run.t[k + 1] - run.t[k]) / kParts;
      const double qd = 1.2 * std::cos(3.0 * (run.t[k] + (i + 0.5) * h));
      bend += h * (qd - std::abs(qd) * bend) / 0.1;
    }
  }
}

// A drive that swings behind its spring, whatever its stiffness: from the
// motor's own sensor, which does not count turns.
TEST(StatesFromData, FollowAMotorThatHasASensor) {
  const Model model = Shipped("cartpole", {"joint_elasticity@hinge"},
                              {{"hinge.drive_stiffness", 50.0}});
  sysid::Run run = EmptyRun(model);
  const auto slide = [](double) { return One(0.0); };
  const auto angle = [](double t) { return One(0.8 * std::cos(5.0 * t)); };
  const auto bend = [](double t) { return 0.05 * std::sin(30.0 * t); };
  const auto motor = [&](double t) {
    return One(angle(t)[0] + bend(t) + 2 * M_PI);
  };
  run.channels = {
      MakeChannel(model, ChannelKind::kPosition, "slider", run.t, 1, slide),
      MakeChannel(model, ChannelKind::kPosition, "hinge", run.t, 1, angle),
      MakeChannel(model, ChannelKind::kMotorPosition, "hinge", run.t, 1,
                  motor)};
  const RowMatrixXd states = States(model, run);
  const int z = model.layout().z();
  for (int k = 5; k + 5 < run.size(); ++k) {
    const double t = run.t[k];
    EXPECT_NEAR(states(k, z), bend(t), 0.002) << t;
    EXPECT_NEAR(states(k, z + 1),
                -4.0 * std::sin(5.0 * t) + 1.5 * std::cos(30.0 * t), 0.15)
        << t;
  }
}

}  // namespace
}  // namespace sysid
