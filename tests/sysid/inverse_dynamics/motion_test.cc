#include "sysid/inverse_dynamics/motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "models/math/rotation.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

Channel Positions(int joint, const std::vector<double>& values) {
  Channel channel;
  channel.kind = ChannelKind::kPosition;
  channel.target = joint;
  channel.values.resize(values.size(), 1);
  for (size_t k = 0; k < values.size(); ++k) channel.values(k, 0) = values[k];
  return channel;
}

// Times 10 ms apart, but for a wobble, from 0 to 1 s.
std::vector<double> UnevenTimes() {
  std::vector<double> t;
  for (int k = 0; k <= 100; ++k) {
    t.push_back(0.01 * k + 0.002 * std::sin(7 * k));
  }
  return t;
}

TEST(SmoothMotion, AQuinticIsWhatItIsWhateverTheSampling) {
  const Model hinge = Shipped("simple_pendulum_dfki");
  const auto q = [](double t) {
    return 1 + t - 3 * t * t + 2 * std::pow(t, 5);
  };
  sysid::Run run;
  run.t = UnevenTimes();
  std::vector<double> values;
  for (const double t : run.t) values.push_back(q(t));
  values[40] = values[41] = NAN;  // a gap
  run.channels = {Positions(0, values)};
  run.effort = RowMatrixXd::Zero(run.size(), 1);
  ASSERT_TRUE(UnmeasuredJoints(hinge, run).empty());
  const double t = 0.43;
  const MotionSample at = SmoothMotion(hinge, run, t, 0.03);
  ASSERT_TRUE(at.known);
  EXPECT_NEAR(at.q[0], q(t), 1e-10);
  EXPECT_NEAR(at.qd[0], 1 - 6 * t + 10 * std::pow(t, 4), 1e-8);
  EXPECT_NEAR(at.qdd[0], -6 + 40 * std::pow(t, 3), 1e-6);
  // With samples on one side only there is nothing to go by.
  EXPECT_FALSE(SmoothMotion(hinge, run, run.t.front(), 0.03).known);
  EXPECT_FALSE(SmoothMotion(hinge, run, run.t.back() + 1.0, 0.03).known);
}

// Even times but for a gap, and uneven ones: sharing must not show.
TEST(MotionSmoother, GivesWhatEachTimeAloneGives) {
  const Model hinge = Shipped("simple_pendulum_dfki");
  for (const bool even : {true, false}) {
    sysid::Run run;
    run.t = UnevenTimes();
    std::vector<double> values;
    for (int k = 0; k < run.size(); ++k) {
      if (even) run.t[k] = 0.01 * k;
      values.push_back(std::sin(9.0 * run.t[k]));
    }
    values[60] = NAN;
    run.channels = {Positions(0, values)};
    run.effort = RowMatrixXd::Zero(run.size(), 1);
    MotionSmoother smoother(hinge, run, 0.03);
    for (int k = 0; k < run.size(); ++k) {
      const double t = 0.005 + 0.01 * k;
      const MotionSample shared = smoother.At(t);
      const MotionSample alone = SmoothMotion(hinge, run, t, 0.03);
      ASSERT_EQ(shared.known, alone.known) << k;
      if (!shared.known) continue;
      EXPECT_NEAR(shared.q[0], alone.q[0], 1e-9) << k;
      EXPECT_NEAR(shared.qd[0], alone.qd[0], 1e-7) << k;
      EXPECT_NEAR(shared.qdd[0], alone.qdd[0], 1e-5) << k;
      EXPECT_NEAR(shared.qd_variance[0], alone.qd_variance[0], 1e-12) << k;
    }
  }
}

// A body that spins up about a fixed axis: rate and acceleration are along it.
TEST(SmoothMotion, ASphericalJointHasItsAngularVelocityAndAcceleration) {
  const Model model = Shipped("pendulum1");
  sysid::Run run;
  Channel channel;
  channel.kind = ChannelKind::kOrientation;
  channel.target = 0;
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -2) / 3;
  const Eigen::Quaterniond start(0.5, 0.5, -0.5, 0.5);
  channel.values.resize(101, 4);
  for (int k = 0; k <= 100; ++k) {
    const double t = 0.01 * k, angle = 4 * t + 3 * t * t;
    run.t.push_back(t);
    const Eigen::Quaterniond turned = start * Exp<double>(angle * axis);
    // Both signs are the same rotation.
    channel.values.row(k) = (k % 2 ? -1 : 1) * turned.coeffs().transpose();
  }
  run.channels = {channel};
  run.effort = RowMatrixXd::Zero(101, 3);
  const MotionSample at = SmoothMotion(model, run, 0.503, 0.03);
  ASSERT_TRUE(at.known);
  EXPECT_LT((at.qd - (4 + 6 * 0.503) * axis).norm(), 1e-7);
  EXPECT_LT((at.qdd - 6 * axis).norm(), 1e-5);
  const Eigen::Quaterniond q(at.q[3], at.q[0], at.q[1], at.q[2]);
  EXPECT_LT(q.angularDistance(
                start * Exp<double>((4 * 0.503 + 3 * 0.503 * 0.503) * axis)),
            1e-9);
}

TEST(SmoothMotion, AJointWithoutAChannelIsNotMeasured) {
  const Model model = Shipped("pendulum2_planar");
  sysid::Run run;
  run.t = {0.0, 1.0};
  run.channels = {Positions(0, {0.0, 0.0})};
  EXPECT_EQ(UnmeasuredJoints(model, run), std::vector<std::string>({"joint2"}));
}

}  // namespace
}  // namespace sysid
