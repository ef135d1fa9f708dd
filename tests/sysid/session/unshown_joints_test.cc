#include "sysid/session/unshown_joints.h"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "tests/support/program_folder.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Wheels on a base; a lift with a head and an arm of two joints.
Mechanism Robot() {
  Inertial<double> body;
  body.mass = 1.0;
  body.inertia = Eigen::Matrix3d::Identity() * 0.01;
  Mechanism mechanism;
  mechanism.AddRoot("base");
  const auto add = [&](const std::string& name, JointType type, int parent) {
    Joint made;
    made.name = name;
    made.type = type;
    made.parent_link = parent;
    const int joint =
        mechanism.AddJoint(made, name + "_link", {0.1, 0.2, 0.3}, body);
    mechanism.joints[joint].effort_limit = name == "wheel" ? 0.0 : 10.0;
  };
  add("wheel", JointType::kContinuous, 0);
  add("lift", JointType::kPrismatic, 0);
  add("head", JointType::kRevolute, 2);
  add("arm", JointType::kRevolute, 2);
  mechanism.joints[2].has_limits = true;
  mechanism.joints[2].lower = 0.2;
  mechanism.joints[2].upper = 1.0;
  return mechanism;
}

class LocksOfUnshownTest : public ::testing::Test {
 protected:
  std::vector<std::string> Held(const std::string& header,
                                const std::vector<NamedValue>& locks = {}) {
    const std::string path = folder_.Path("run.csv");
    folder_.Write("run.csv", header + "\n");
    std::vector<std::string> held;
    notices_.clear();
    for (const NamedValue& lock : LocksOfUnshown(
             Robot(), NamesInFiles(Robot(), {path}, {}), locks, &notices_)) {
      held.push_back(lock.name);
    }
    return held;
  }

  ProgramFolder folder_;
  std::vector<std::string> notices_;
};

TEST_F(LocksOfUnshownTest, HoldsWhatTheRecordingDoesNotShow) {
  EXPECT_THAT(Held("t,lift.q,arm.q,lift.tau"), ElementsAre("wheel", "head"));
  EXPECT_THAT(notices_,
              ElementsAre("no recording shows wheel, head=0.2: held still, at "
                          "zero where no position is said (--lock "
                          "JOINT=POSITION holds one elsewhere)"));
  EXPECT_THAT(Held("t,lift.q,arm.q,lift.tau", {{"head", 0.3}}),
              ElementsAre("wheel"));
}

// Without efforts nothing says that motors hold it: its motion is estimated.
TEST_F(LocksOfUnshownTest, LeavesWhatMaySwing) {
  EXPECT_THAT(Held("t,lift.q,arm.q"), ElementsAre("wheel"));
  EXPECT_THAT(Held("t,arm.q"), ElementsAre("wheel", "head"));
}

TEST_F(LocksOfUnshownTest, KnowsWhatRunsInMemoryShow) {
  const Mechanism robot = Robot();
  const int lift = robot.FindJoint("lift");
  sysid::Run run;
  run.t = {0.0, 0.1};
  run.channels = {{ChannelKind::kPosition, lift, "lift", {}, {}}};
  run.recorded_efforts.assign(robot.nv, false);
  run.recorded_efforts[robot.joints[lift].v_index] = true;
  run.inputs = {{"head.cmd", true, {0.3, 0.3}}};
  EXPECT_THAT(NamesInRuns(robot, {run}),
              ElementsAre("head.cmd", "lift.q", "lift.tau"));
}

TEST_F(LocksOfUnshownTest, HoldsNothingWhereNothingIsKnown) {
  EXPECT_THAT(Held("t,a,b"), IsEmpty());
  EXPECT_THAT(Held("t,arm.q,head_link.px"), IsEmpty());
  EXPECT_THAT(Held("t,wheel.q,lift.cmd,head.q,arm.tau"), IsEmpty());
  EXPECT_THAT(notices_, IsEmpty());
}

}  // namespace
}  // namespace sysid
