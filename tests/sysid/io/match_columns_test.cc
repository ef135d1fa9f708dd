#include "sysid/io/match_columns.h"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "sysid/io/column_names.h"
#include "tests/sysid/io/chain.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Mechanism Arm(const std::vector<std::string>& joints) {
  std::vector<std::pair<std::string, JointType>> chain;
  for (const std::string& name : joints) {
    chain.emplace_back(name, JointType::kRevolute);
  }
  return Chain(chain);
}

ColumnMatches Match(const Mechanism& mechanism,
                    const std::vector<std::string>& columns) {
  return MatchColumns(mechanism, columns,
                      [](const std::string&) { return true; });
}

std::vector<std::string> MapOf(const std::vector<std::string>& joints,
                               const std::vector<std::string>& columns) {
  std::vector<std::string> entries;
  for (const ColumnMapping& entry : Match(Arm(joints), columns).map) {
    entries.push_back(entry.name + "=" + entry.expression);
  }
  return entries;
}

TEST(MatchColumns, NamesComeBeforeOrder) {
  EXPECT_THAT(MapOf({"shoulder", "elbow"},
                    {"elbow_pos", "shoulder_pos", "elbow_eff", "shoulder_eff"}),
              ElementsAre("shoulder.q=shoulder_pos", "elbow.q=elbow_pos",
                          "shoulder.tau=shoulder_eff", "elbow.tau=elbow_eff"));
  EXPECT_THAT(MapOf({"shoulder", "elbow"},
                    {"/js/left_elbow/position", "/js/left_shoulder/position"}),
              ElementsAre("shoulder.q=/js/left_shoulder/position",
                          "elbow.q=/js/left_elbow/position"));
  // Of joints whose names share words by the others.
  EXPECT_THAT(MapOf({"arm_1_joint", "arm_2_joint", "forearm_joint"},
                    {"forearm_joint_position", "arm_2_joint_position",
                     "arm_1_joint_position"}),
              ElementsAre("arm_1_joint.q=arm_1_joint_position",
                          "arm_2_joint.q=arm_2_joint_position",
                          "forearm_joint.q=forearm_joint_position"));
}

TEST(MatchColumns, NumbersCountWhereTheyLeaveNothingOver) {
  EXPECT_THAT(MapOf({"joint1", "joint2"}, {"q2", "q1"}),
              ElementsAre("joint1.q=q1", "joint2.q=q2"));
  EXPECT_THAT(MapOf({"joint1", "joint2"}, {"q0", "q1"}),
              ElementsAre("joint1.q=q0", "joint2.q=q1"));
}

TEST(MatchColumns, OrderIsTheLastResortAndSaysSo) {
  const Mechanism arm = Arm({"shoulder", "elbow"});
  const ColumnMatches index = Match(arm, {"q10", "q2", "dq2", "dq10"});
  EXPECT_EQ(index.map[0].expression, "q2");
  EXPECT_EQ(index.map[1].expression, "q10");
  EXPECT_THAT(index.by_order,
              ElementsAre("shoulder.q", "elbow.q", "shoulder.qd", "elbow.qd"));
  // Not beside names that match, and not where there is one of each.
  const ColumnMatches width = Match(arm, {"elbow_deg", "width_mm"});
  EXPECT_EQ(width.map.size(), 1);
  EXPECT_THAT(width.left, ElementsAre("width_mm"));
  EXPECT_THAT(Match(Arm({"wrist"}), {"pos"}).by_order, IsEmpty());
}

TEST(MatchColumns, KindsAndUnitsAreThoseOfTheName) {
  EXPECT_THAT(
      MapOf({"servo"}, {"goal_deg", "pos_deg", "speed_rpm", "load_nm"}),
      ElementsAre("servo.q=pos_deg*0.0174532925", "servo.qd=speed_rpm*2*pi/60",
                  "servo.tau=load_nm", "servo.cmd=goal_deg*0.0174532925"));
  EXPECT_THAT(
      MapOf({"servo"}, {"servo_rev", "/torque_cmd/data[0]"}),
      ElementsAre("servo.q=servo_rev*2*pi", "servo.tau=/torque_cmd/data[0]"));
  // A measured effort is better than a commanded one.
  EXPECT_THAT(MapOf({"servo"}, {"tau_des", "tau_meas"}),
              ElementsAre("servo.tau=tau_meas"));
}

TEST(ColumnNames, WordsEndWhereNumbersBegin) {
  EXPECT_THAT(WordsOf("Time [ms]"), ElementsAre("time", "ms"));
  EXPECT_THAT(WordsOf("pos_meas1"), ElementsAre("pos", "meas", "1"));
  EXPECT_THAT(WordsOf(""), IsEmpty());
}

TEST(QuotedColumn, QuotesWhatIsNoPlainOperand) {
  EXPECT_EQ(QuotedColumn("/a/b[0]"), "/a/b[0]");
  EXPECT_EQ(QuotedColumn("- arm_1"), "\"- arm_1\"");
  EXPECT_EQ(QuotedColumn("pos, left"), "\"pos, left\"");
}

}  // namespace
}  // namespace sysid
