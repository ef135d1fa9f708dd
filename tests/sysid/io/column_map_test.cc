#include "sysid/io/column_map.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/error_text.h"
#include "tests/sysid/io/chain.h"

namespace sysid {
namespace {

ColumnSource Resolve(const std::string& entry,
                     const std::vector<std::string>& header) {
  return ResolveColumns(ParseColumnMap(entry), header, "run.csv", Hinges())
      .at(0);
}

std::string ResolveError(const std::string& entry,
                         const std::vector<std::string>& header) {
  return ErrorText([&] { Resolve(entry, header); });
}

TEST(ColumnMapTest, SplitsTheFlag) {
  const ColumnMap map =
      ParseColumnMap(" joint1.q = pos1 * 2 ,t=time_ms*0.001", "--columns");
  ASSERT_EQ(map.size(), 2u);
  EXPECT_EQ(map[0].name, "joint1.q");
  EXPECT_EQ(map[0].expression, "pos1 * 2");
  EXPECT_EQ(map[1].name, "t");
  EXPECT_EQ(map[1].expression, "time_ms*0.001");
  EXPECT_EQ(map[1].place, "--columns");
  EXPECT_TRUE(ParseColumnMap("").empty());
}

TEST(ColumnMapTest, ReportsEntriesThatAreNone) {
  const std::string hint =
      "\n  hint: write name=column or name=column*factor, such as "
      "joint1.q=pos1*0.0174532925";
  EXPECT_EQ(ErrorText([] { ParseColumnMap("t=time,pos1"); }),
            "--columns: 'pos1' has no '='" + hint);
  EXPECT_EQ(ErrorText([] { ParseColumnMap("t=time,"); }),
            "--columns: '' has no '='" + hint);
  EXPECT_EQ(ErrorText([] { ParseColumnMap("=pos1"); }),
            "--columns: '=pos1' has no name before '='" + hint);
  EXPECT_EQ(ErrorText([] { ParseColumnMap("t="); }),
            "--columns: 't=' has no column after '='" + hint);
  EXPECT_EQ(ErrorText([] { ParseColumnMap("t=a,t=b"); }),
            "--columns: 't' is given twice: 'a' and 'b'\n"
            "  hint: keep one of them");
}

TEST(ColumnMapTest, FlagsWinOverTheFile) {
  const ColumnMap merged =
      MergeColumnMaps({{"t", "time", "f:1:1"}, {"joint1.q", "a", "f:2:1"}},
                      {{"joint1.q", "b", "--columns"}});
  ASSERT_EQ(merged.size(), 2u);
  EXPECT_EQ(merged[0].expression, "b");
  EXPECT_EQ(merged[1].expression, "time");
}

TEST(ColumnMapTest, ReadsFactorsOffsetsAndSigns) {
  const struct {
    std::string expression;
    double factor, offset;
    bool has_factor;
  } cases[] = {
      {"pos", 1, 0, false},
      {"pos*2", 2, 0, true},
      {"pos * 2e-3", 2e-3, 0, true},
      {"pos/4", 0.25, 0, true},
      {"pos*3/2", 1.5, 0, true},
      {"-pos", -1, 0, true},
      {"- pos*2+1", -2, 1, true},
      {"pos-0.5", 1, -0.5, false},
      {"pos*-2 - 1e-3", -2, -1e-3, true},
      {"pos*1", 1, 0, true},
  };
  for (const auto& c : cases) {
    const ColumnSource source =
        Resolve("joint1.q=" + c.expression, {"t", "pos"});
    EXPECT_EQ(source.column, 1) << c.expression;
    EXPECT_DOUBLE_EQ(source.factor, c.factor) << c.expression;
    EXPECT_DOUBLE_EQ(source.offset, c.offset) << c.expression;
    EXPECT_EQ(source.has_factor, c.has_factor) << c.expression;
  }
}

TEST(ColumnMapTest, AColumnThatIsThereWinsOverAnExpression) {
  const std::vector<std::string> header = {
      "t",        "/joint_states/pos[0]", "run-1", "run", "a*2", "a", "-b",
      "two words"};
  EXPECT_EQ(Resolve("joint1.q=/joint_states/pos[0]", header).column, 1);
  EXPECT_EQ(Resolve("joint1.q=run-1", header).column, 2);
  EXPECT_EQ(Resolve("joint1.q=a*2", header).column, 4);
  EXPECT_EQ(Resolve("joint1.q=-b", header).column, 6);
  EXPECT_EQ(Resolve("joint1.q=-b", header).factor, 1.0);
  EXPECT_EQ(Resolve("joint1.q=run-1*2", header).column, 2);
  EXPECT_EQ(Resolve("joint1.q=run -1", header).column, 3);
  EXPECT_EQ(Resolve("joint1.q=two words*2", header).column, 7);
  const ColumnSource source =
      Resolve("joint1.q=-/joint_states/pos[0]/2", header);
  EXPECT_EQ(source.column, 1);
  EXPECT_EQ(source.factor, -0.5);
}

TEST(ColumnMapTest, ReportsAColumnThatIsNotThere) {
  EXPECT_EQ(ResolveError("joint1.q=pos_maes1*2", {"t", "pos_meas1", "vel"}),
            "--columns: run.csv has no column 'pos_maes1' (for 'joint1.q')\n"
            "  hint: did you mean 'pos_meas1'?");
  EXPECT_EQ(ResolveError("joint1.q=zzz", {"t", "a"}),
            "--columns: run.csv has no column 'zzz' (for 'joint1.q')\n"
            "  hint: known: t, a");
  EXPECT_EQ(ResolveError("joint1.q=run-2", {"t", "run-1"}),
            "--columns: run.csv has no column 'run-2' (for 'joint1.q')\n"
            "  hint: did you mean 'run-1'?");
  EXPECT_EQ(ResolveError("t=0.001*time", {"time", "a"}),
            "--columns: run.csv has no column '0.001' (for 't')\n"
            "  hint: the factor goes behind the column: t=time*0.001");
}

TEST(ColumnMapTest, ReportsABadFactor) {
  const std::string hint =
      "\n  hint: write column*number, such as joint1.q=deg*0.0174532925";
  EXPECT_EQ(
      ResolveError("joint1.q=pos*pi", {"t", "pos"}),
      "--columns: factor 'pi' is not a number (in 'joint1.q=pos*pi')" + hint);
  EXPECT_EQ(ResolveError("joint1.q=pos*", {"t", "pos"}),
            "--columns: factor '' is not a number (in 'joint1.q=pos*')" + hint);
  EXPECT_EQ(ResolveError("joint1.q=pos*0", {"t", "pos"}),
            "--columns: factor '0' is zero (in 'joint1.q=pos*0')" + hint);
  EXPECT_EQ(
      ResolveError("joint1.q=pos*inf", {"t", "pos"}),
      "--columns: factor 'inf' is not a number (in 'joint1.q=pos*inf')" + hint);
  EXPECT_EQ(
      ResolveError("joint1.q=pos+x", {"t", "pos"}),
      "--columns: offset 'x' is not a number (in 'joint1.q=pos+x')" + hint);
  EXPECT_EQ(
      ResolveError("joint1.q=pos+1*2", {"t", "pos"}),
      "--columns: a factor after an offset (in 'joint1.q=pos+1*2')" + hint);
  EXPECT_EQ(ResolveError("joint1.q=pos/1e200/1e200", {"t", "pos"}),
            "--columns: the factors' product is 0 (in "
            "'joint1.q=pos/1e200/1e200')" +
                hint);
}

TEST(ColumnMapTest, ReportsAnUnknownName) {
  EXPECT_EQ(ResolveError("jiont1.q=pos", {"t", "pos"}),
            "--columns: the model has no joint 'jiont1' (column 'jiont1.q')\n"
            "  hint: did you mean 'joint1.q'?");
  EXPECT_EQ(ResolveError("tpi.px=pos", {"t", "pos"}),
            "--columns: the model has no link 'tpi' (column 'tpi.px')\n"
            "  hint: known: world, joint1_link, joint2_link, tip");
  EXPECT_EQ(ResolveError("joint1.pos=pos", {"t", "pos"}),
            "--columns: 'joint1.pos' is not a column of a run\n"
            "  hint: did you mean 'joint1.q'?");
  EXPECT_EQ(ResolveError("joint1.qw=pos", {"t", "pos"}),
            "--columns: joint 'joint1' is revolute and has no column "
            "'joint1.qw'\n"
            "  hint: its columns are joint1.q, joint1.qd, joint1.tau");
  EXPECT_EQ(ResolveError("tip_joint.q=pos", {"t", "pos"}),
            "--columns: joint 'tip_joint' is fixed and has no column "
            "'tip_joint.q'\n"
            "  hint: it does not move");
}

}  // namespace
}  // namespace sysid
