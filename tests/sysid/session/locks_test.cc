#include "sysid/session/locks.h"

#include <gmock/gmock.h>

#include "models/dynamics.h"
#include "models/hold_joints.h"
#include "sysid/session/named_values.h"
#include "tests/support/conditioning.h"
#include "tests/support/dynamics_calls.h"
#include "tests/support/error_text.h"
#include "tests/support/random_mechanism.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A base with two wheels, a head of two hinges, a ball and a slide.
Mechanism Robot() {
  const Inertial<double> body = Body(1.0, {0.1, 0, 0.05}, {0.02, 0.03, 0.04});
  Mechanism mechanism;
  mechanism.AddRoot("base");
  const auto add = [&](const std::string& name, JointType type, int parent,
                       const Eigen::Vector3d& axis) {
    mechanism.AddJoint(MakeJoint(name, type, parent, axis), name + "_link",
                       {0.1, 0.2, 0.3}, body);
  };
  using Eigen::Vector3d;
  add("wheel_left", JointType::kContinuous, 0, Vector3d::UnitY());
  add("wheel_right", JointType::kContinuous, 0, Vector3d::UnitY());
  add("lift", JointType::kPrismatic, 0, Vector3d::UnitZ());
  add("head_1", JointType::kRevolute, 3, Vector3d::UnitZ());
  add("head_2", JointType::kRevolute, 4, Vector3d::UnitY());
  add("ball", JointType::kSpherical, 4, Vector3d::UnitX());
  add("mount", JointType::kFixed, 6, Vector3d::UnitX());
  mechanism.joints[3].has_limits = true;
  mechanism.joints[3].lower = -1;
  mechanism.joints[3].upper = 1;
  return mechanism;
}

std::vector<NamedValue> Resolved(const std::string& flag) {
  return ResolveLocks(Robot(), SplitAssignments(flag, "--lock"));
}

std::vector<std::string> Texts(const std::string& flag) {
  std::vector<std::string> texts;
  for (const NamedValue& lock : Resolved(flag)) {
    texts.push_back(lock.name + "=" + std::to_string(*lock.value).substr(0, 4));
  }
  return texts;
}

TEST(ResolveLocks, KnowsNamesAndPatterns) {
  EXPECT_THAT(
      Texts("wheel_*,head_1=0.3"),
      ElementsAre("wheel_left=0.00", "wheel_right=0.00", "head_1=0.30"));
  EXPECT_THAT(Texts("head_?=0.2,head_2=0.5"),
              ElementsAre("head_1=0.20", "head_2=0.50"));
  EXPECT_THAT(Texts("head_[2-9]"), ElementsAre("head_2=0.00"));
  EXPECT_THAT(Texts("ball"), ElementsAre("ball=0.00"));
  EXPECT_THAT(Texts(""), IsEmpty());
}

TEST(ResolveLocks, RefusesWhatMeetsNoJointThatMoves) {
  const auto error = [](const std::string& flag) {
    return ErrorText([&] { Resolved(flag); });
  };
  EXPECT_EQ(error("hed_1"),
            "--lock: no joint that moves is named 'hed_1'\n  hint: did you "
            "mean 'head_1'?");
  EXPECT_EQ(error("mount"),
            "--lock: joint 'mount' is fixed already\n  hint: leave it out");
  EXPECT_EQ(error("ball=0.3"),
            "--lock: joint 'ball' is spherical: it cannot be held at 0.3\n  "
            "hint: write ball alone: it is then held at the identity");
}

TEST(LockJoints, HoldsThemAndSaysWhatIsBeyondItsLimits) {
  std::vector<std::string> notices;
  const Mechanism held =
      LockJoints(Robot(), Resolved("wheel_*,head_1=2"), &notices);
  EXPECT_THAT(held.JointNames(), ElementsAre("lift", "head_2", "ball"));
  EXPECT_EQ(held.nv, 5);
  EXPECT_EQ(held.LinkNames(), Robot().LinkNames());
  EXPECT_THAT(notices, ElementsAre("held beyond the limits: head_1 at 2 "
                                   "(limits -1 to 1)"));
  EXPECT_THAT(ErrorText([&] { LockJoints(Robot(), Resolved("*"), &notices); }),
              HasSubstr("--lock: holds every joint that moves"));
}

// Rows and columns of the whole robot's inertia, at the same place.
TEST(HoldJoints, MoveAsTheWholeRobotWithTheseAtRest) {
  const Mechanism whole = Robot();
  const std::map<int, double> at = {{1, 0.7}, {2, -0.2}, {3, 0.4}};
  const Mechanism held = HoldJoints(whole, at);
  Random random(5);
  for (int trial = 0; trial < 20; ++trial) {
    const RandomState x(held, &random);
    Eigen::VectorXd q = Eigen::VectorXd::Zero(whole.nq);
    std::vector<int> kept;
    for (size_t j = 0; j < whole.joints.size(); ++j) {
      const Joint& joint = whole.joints[j];
      const auto position = at.find(static_cast<int>(j));
      if (position != at.end()) {
        q[joint.q_index] = position->second;
        continue;
      }
      const Joint& same = held.joints[j];
      for (int k = 0; k < ConfigurationSize(joint.type); ++k) {
        q[joint.q_index + k] = x.q[same.q_index + k];
      }
      for (int k = 0; k < VelocitySize(joint.type); ++k) {
        kept.push_back(joint.v_index + k);
      }
    }
    const Model whole_model(whole), held_model(held);
    Workspace<double> all(whole_model), some(held_model);
    const Eigen::MatrixXd M = Inertia(&all, q);
    EXPECT_LT((Inertia(&some, x.q) - M(kept, kept)).norm(), 1e-14 * M.norm());
    ForwardKinematics<double>(&all, q.data());
    ForwardKinematics<double>(&some, x.q.data());
    for (int link = 0; link < static_cast<int>(whole.links.size()); ++link) {
      EXPECT_LT(
          (LinkPosition<double>(all, link) - LinkPosition<double>(some, link))
              .norm(),
          1e-14);
    }
  }
}

TEST(HoldJoints, TakesAlongTheMimics) {
  Mechanism whole = Robot();
  whole.joints[1].mimic = Mimic{"wheel_left", -2.0, 0.1};
  whole.joints[0].mimic = Mimic{"head_1", 3.0, 0.0};
  const Mechanism held = HoldJoints(whole, {{3, 0.5}});
  EXPECT_EQ(held.joints[0].held->position, 1.5);
  EXPECT_EQ(held.joints[1].held->position, -2.9);
  // Held anew, it is where it is held last.
  const Mechanism anew = HoldJoints(held, {{3, 0.0}});
  EXPECT_EQ(anew.joints[3].R_PJ, whole.joints[3].R_PJ);
  EXPECT_EQ(anew.joints[1].held->position, 0.1);
}

// With its leader it is where that puts it, alone at its offset.
TEST(LockJoints, HoldMimicsWhereTheirLeadersPutThem) {
  Mechanism robot = Robot();
  robot.joints[1].mimic = Mimic{"wheel_left", -2.0, 0.125};
  robot = HoldJoints(robot, {});
  const auto held = [&](const std::string& flag) {
    std::vector<std::string> notices;
    return LockJoints(
        robot, ResolveLocks(robot, SplitAssignments(flag, "--lock")), &notices);
  };
  EXPECT_EQ(held("wheel_left=0.5").joints[1].held->position, -0.875);
  EXPECT_EQ(held("wheel_*=0.5").joints[1].held->position, 0.5);
  EXPECT_EQ(held("wheel_*").joints[1].held->position, 0.125);
  EXPECT_EQ(held("wheel_right").joints[1].held->position, 0.125);
  EXPECT_EQ(held("wheel_right").nv, robot.nv);
}

TEST(UnmeasuredNotice, NamesThemWithTheFlagToPaste) {
  const Mechanism mechanism = Robot();
  sysid::Run run;
  run.t = {0.0, 0.1};
  run.effort = RowMatrixXd::Zero(2, mechanism.nv);
  Channel channel;
  channel.target = 3;
  run.channels = {channel};
  run.effort(0, 0) = 1.0;
  EXPECT_EQ(UnmeasuredNotice(mechanism, {&run}, {{"mount_2", 0.1, "--lock"}}),
            "no column of wheel_right, lift, head_2, ball: their motions are "
            "estimated from the others; hold still by --lock "
            "'mount_2=0.1,wheel_right,lift,head_2,ball'");
  run.channels.push_back(channel);
  run.channels.back().kind = ChannelKind::kFramePosition;
  EXPECT_EQ(UnmeasuredNotice(mechanism, {&run}, {}), "");
}

}  // namespace
}  // namespace sysid
