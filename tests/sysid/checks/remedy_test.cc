#include "sysid/checks/remedy.h"

#include <gtest/gtest.h>

namespace sysid {
namespace {

TEST(RemedyTest, SignsAndFactorsOfExpressions) {
  EXPECT_EQ(Negated("pos1"), "-pos1");
  EXPECT_EQ(Negated("-pos1"), "pos1");
  EXPECT_EQ(Negated("pos1*1e-3"), "-pos1*1e-3");
  EXPECT_EQ(Negated("a-b"), "-(a-b)");
  EXPECT_EQ(Times("pos1*2", "0.001"), "pos1*2*0.001");
  EXPECT_EQ(Times("a+b", "0.001"), "(a+b)*0.001");
  EXPECT_EQ(Minus("a", "b"), "a-b");
  EXPECT_EQ(Minus("a", "-b"), "a+b");
  EXPECT_EQ(Minus("a", "b+c"), "a-(b+c)");
}

// A flag may be given once: the remedy repeats what it said already.
TEST(RemedyTest, FlagsRepeatWhatWasGiven) {
  CheckInput input;
  input.flag_columns = ParseColumnMap("t=time,joint1.q=pos1");
  input.columns = input.flag_columns;
  input.flag_edits.shifts = ParseShifts("joint2.q=0.002", "--shift");
  EXPECT_EQ(SourceOf(input, "joint1.q"), "pos1");
  EXPECT_EQ(SourceOf(input, "joint2.q"), "joint2.q");
  EXPECT_EQ(ColumnsFlag(input, {{"joint1.q", "-pos1"}}),
            "--columns t=time,joint1.q=-pos1");
  EXPECT_EQ(ColumnsFlag(input, {{"t", "time*0.001"}}),
            "--columns 'joint1.q=pos1,t=time*0.001'");
  EXPECT_EQ(ShiftFlag(input, "joint1.q", 0.01),
            "--shift joint2.q=0.002,joint1.q=0.01");
  EXPECT_EQ(ShiftFlag(input, "joint2.q", 0.01), "--shift joint2.q=0.012");
  EXPECT_EQ(IgnoreFlag(input, "a.csv", {"joint1.q"}, {{1, 2.5}}),
            "--ignore joint1.q@1:2.5");
}

}  // namespace
}  // namespace sysid
