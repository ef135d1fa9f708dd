#include "sysid/simulation/joint_limits.h"

#include <gmock/gmock.h>

#include "tests/support/dynamics_calls.h"

namespace sysid {
namespace {

// q = -2 leader + 0.5 within [-0.5, 1.5], at most 3 rad/s.
Mechanism Pair(double upper) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  const Inertial<double> body = Body(1, {0.1, 0, 0}, {0.01, 0.01, 0.01});
  for (const char* name : {"leader", "follower"}) {
    Joint joint = MakeJoint(name, JointType::kRevolute, 0, {1, 0, 0});
    joint.has_limits = true;
    joint.velocity_limit = joint.name == "leader" ? 2.0 : 3.0;
    joint.effort_limit = 10.0;
    joint.lower = joint.name == "leader" ? -0.25 : -0.5;
    joint.upper = joint.name == "leader" ? upper : 1.5;
    if (joint.name == "follower") joint.mimic = Mimic{"leader", -2.0, 0.5};
    mechanism.AddJoint(joint, joint.name + "_link", {0, 0, 0}, body);
  }
  return mechanism;
}

TEST(LimitedJoint, KeepsTheLimitsOfItsFollowers) {
  const Model model(Pair(2.0));
  ASSERT_EQ(model.movers().size(), 1u);
  const Joint joint = LimitedJoint(model, model.movers()[0]);
  EXPECT_EQ(joint.lower, -0.25);  // -0.5 of the follower
  EXPECT_EQ(joint.upper, 0.5);
  EXPECT_EQ(VelocityLimit(joint), 1.5);
  EXPECT_EQ(EffortLimit(joint), 10.0);
}

TEST(LimitedJoint, KeepsItsOwnWhereNothingIsInAll) {
  Mechanism mechanism = Pair(2.0);
  mechanism.joints[1].lower = 5.0;
  mechanism.joints[1].upper = 6.0;
  const Model model(mechanism);
  const Joint joint = LimitedJoint(model, model.movers()[0]);
  EXPECT_EQ(joint.lower, -0.25);
  EXPECT_EQ(joint.upper, 2.0);
}

}  // namespace
}  // namespace sysid
