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
  EXPECT_EQ(ShiftFlag(input, {"joint1.q"}, 0.01),
            "--shift joint2.q=0.002,joint1.q=0.01");
  EXPECT_EQ(ShiftFlag(input, {"joint2.q"}, 0.01), "--shift joint2.q=0.012");
  EXPECT_EQ(IgnoreFlag(input, "a.csv", {"joint1.q"}, {{1, 2.5}}),
            "--ignore joint1.q@1:2.5");
  EXPECT_EQ(ShiftFlag(input, {"joint2.q"}, -0.002), "--shift ''");
  EXPECT_EQ(ShiftFlag(input, {"joint1.q", "joint2.q"}, 7 * 0.002),
            "--shift joint1.q=0.014,joint2.q=0.016");
}

// For one run of several; what was given for all of them stays.
TEST(RemedyTest, FlagsOfOneRun) {
  CheckInput input;
  input.scope = "b.csv/";
  input.flag_columns = ParseColumnMap("joint1.q=pos1,b.csv/joint2.q=pos2");
  EXPECT_EQ(ColumnsFlag(input, {{"joint1.q", "-pos1"}}),
            "--columns 'joint1.q=pos1,b.csv/joint2.q=pos2,b.csv/"
            "joint1.q=-pos1'");
  EXPECT_EQ(ColumnsFlag(input, {{"joint2.q", "-pos2"}}),
            "--columns 'joint1.q=pos1,b.csv/joint2.q=-pos2'");
  const auto shift = [&](const std::string& given, double delay) {
    input.flag_edits.shifts = ParseShifts(given, "--shift");
    return ShiftFlag(input, {"joint1.q"}, delay);
  };
  EXPECT_EQ(shift("", 0.01), "--shift 'b.csv/joint1.q=0.01'");
  EXPECT_EQ(shift("joint1.q=0.02", 0.01),
            "--shift 'joint1.q=0.02,b.csv/joint1.q=0.03'");
  EXPECT_EQ(shift("b.csv/joint1.q=0.02", -0.02), "--shift ''");
  EXPECT_EQ(shift("joint1.q=0.02", -0.02),
            "--shift 'joint1.q=0.02,b.csv/joint1.q=0'");
  EXPECT_EQ(shift("joint1.q=0.02,b.csv/joint1.q=0.03", -0.03),
            "--shift 'joint1.q=0.02,b.csv/joint1.q=0'");
}

TEST(RemedyTest, RunsAreNamedWhereThereAreSeveral) {
  sysid::Run a, b, c;
  a.name = "x/a.csv";
  b.name = "x/b.csv";
  c.name = "y/b.csv";
  CheckInput input;
  input.runs = {&a};
  EXPECT_EQ(RunScope(input, a.name), "");
  input.runs = {&a, &b, &c};
  EXPECT_EQ(RunScope(input, a.name), "a.csv/");
  EXPECT_EQ(RunScope(input, c.name), "y/b.csv/");
  // As the flags name it.
  input.flag_columns = ParseColumnMap("x/a.csv/joint1.q=pos1");
  EXPECT_EQ(RunScope(input, a.name), "x/a.csv/");
  input.runs = {&a};
  EXPECT_EQ(RunScope(input, a.name), "x/a.csv/");
}

}  // namespace
}  // namespace sysid
