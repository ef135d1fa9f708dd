#include "sysid/io/run_columns.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sysid/io/chain.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;

TEST(RunColumnsTest, NamesTheColumnsOfEveryJointType) {
  const Mechanism mechanism = Chain(
      {{"ball", JointType::kSpherical}, {"slide", JointType::kPrismatic}});
  EXPECT_THAT(
      RunColumnNames(mechanism),
      ElementsAre(
          "t", "ball.qw", "ball.qx", "ball.qy", "ball.qz", "ball.wx", "ball.wy",
          "ball.wz", "ball.taux", "ball.tauy", "ball.tauz", "slide.q",
          "slide.qd", "slide.motor_q", "slide.tau", "world.px", "world.py",
          "world.pz", "ball_link.px", "ball_link.py", "ball_link.pz",
          "slide_link.px", "slide_link.py", "slide_link.pz", "tip.px", "tip.py",
          "tip.pz", "ball.temperature", "slide.cmd", "slide.temperature",
          "base.ax", "base.ay", "base.az", "base.px", "base.py", "base.pz"));
}

// The columns of a root that is called so are the base's own.
TEST(RunColumnsTest, BelongToTheBaseWhereTheRootIsCalledSo) {
  Mechanism mechanism = Chain({{"hinge", JointType::kRevolute}});
  mechanism.links[0].name = "base";
  for (const ColumnGroup& group : RunColumnGroups(mechanism)) {
    EXPECT_NE(group.name, "base");
  }
  mechanism.inputs = {"wind"};
  EXPECT_THAT(RunColumnNames(mechanism),
              ::testing::IsSupersetOf({"base.px", "base.az", "wind"}));
}

TEST(RunColumnsTest, QuaternionsAreXyzwInMemory) {
  const ColumnGroup group =
      RunColumnGroups(Chain({{"ball", JointType::kSpherical}}))[0];
  EXPECT_EQ(group.kind, ChannelKind::kOrientation);
  EXPECT_EQ(group.name, "ball");
  EXPECT_THAT(group.slots, ElementsAre(3, 0, 1, 2));
}

TEST(RunColumnsTest, NamesMayHaveDots) {
  EXPECT_TRUE(HasRunColumnSuffix("arm.joint1.q"));
  EXPECT_FALSE(HasRunColumnSuffix("q"));
  EXPECT_FALSE(HasRunColumnSuffix(".q"));
  EXPECT_FALSE(HasRunColumnSuffix("joint1.Q"));
  const Mechanism mechanism = Chain({{"arm.joint1", JointType::kRevolute}});
  EXPECT_EQ(ExplainUnknownColumn("arm.jiont1.q", mechanism).hint,
            "did you mean 'arm.joint1.q'?");
}

TEST(RunColumnsTest, JointsThatFollowOthersHaveNone) {
  Mechanism mechanism = Chain(
      {{"drive", JointType::kPrismatic}, {"finger", JointType::kRevolute}});
  for (Joint& joint : mechanism.joints) {
    if (joint.name == "finger") joint.mimic = Mimic{"drive", 2.0, 0.0};
  }
  for (const std::string& name : RunColumnNames(mechanism)) {
    EXPECT_NE(name.substr(0, 7), "finger.") << name;
  }
  const ColumnNameFault fault = ExplainUnknownColumn("finger.q", mechanism);
  EXPECT_EQ(fault.what,
            "joint 'finger' follows joint 'drive' (<mimic>) and has no column "
            "'finger.q'");
  EXPECT_EQ(fault.hint, "measure that one, or leave its <mimic> out");
}

}  // namespace
}  // namespace sysid
