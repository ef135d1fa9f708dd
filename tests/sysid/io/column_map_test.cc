#include "sysid/io/column_map.h"

#include <gmock/gmock.h>
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

// Of the map's entries those for this run, whose own win.
TEST(ColumnMapTest, EntriesOfOneRun) {
  const ColumnMap map = ParseColumnMap(
      "t=time,joint1.q=a,b.csv/joint1.q=-a,runs/c.csv/joint1.q=2*a");
  const auto position = [&](const std::string& path) {
    for (const ColumnMapping& entry : ColumnsOf(map, path, Hinges())) {
      if (entry.name == "joint1.q") return entry.expression;
    }
    return std::string();
  };
  EXPECT_EQ(position("runs/a.csv"), "a");
  EXPECT_EQ(position("runs/b.csv"), "-a");
  EXPECT_EQ(position("b.csv"), "-a");
  EXPECT_EQ(position("runs/c.csv"), "2*a");
  EXPECT_EQ(position("other/c.csv"), "a");
  EXPECT_EQ(ColumnsOf(map, "b.csv", Hinges()).size(), 2u);
}

TEST(ColumnMapTest, FlagsWinOverTheFile) {
  const ColumnMap merged = MergeByName<ColumnMapping>(
      {{"t", "time", "f:1:1"}, {"joint1.q", "a", "f:2:1"}},
      {{"joint1.q", "b", "--columns"}});
  ASSERT_EQ(merged.size(), 2u);
  EXPECT_EQ(merged[0].expression, "b");
  EXPECT_EQ(merged[1].expression, "time");
}

TEST(ColumnMapTest, ACommaInANameIsQuoted) {
  const ColumnMap map = ParseColumnMap("joint1.q=2*'pos, deg',t=\"a,b\"");
  ASSERT_EQ(map.size(), 2u);
  EXPECT_EQ(map[0].expression, "2*'pos, deg'");
  EXPECT_EQ(map[1].expression, "\"a,b\"");
  // Tabs are blanks as spaces are.
  EXPECT_EQ(ParseColumnMap("t=\t'a,b',joint1.q=2*\t'c,d'").size(), 2u);
  // An apostrophe in a name opens nothing.
  EXPECT_EQ(ParseColumnMap("t=arm's,joint1.q=x'").size(), 2u);
}

TEST(ColumnMapTest, NamesTheColumnsThatAnExpressionUses) {
  const ColumnSource source = Resolve("joint1.q=(b - a)/2", {"t", "a", "b"});
  EXPECT_THAT(source.expression.columns(), testing::ElementsAre(2, 1));
  EXPECT_EQ(source.column(), 2);
  EXPECT_EQ(source.text, "(b - a)/2");
  EXPECT_TRUE(source.expression.has_factor());
}

TEST(ColumnMapTest, ReportsAColumnThatIsNotThere) {
  EXPECT_EQ(ResolveError("joint1.q=pos_maes1", {"t", "pos_meas1", "vel"}),
            "--columns: run.csv has no column 'pos_maes1' (for 'joint1.q')\n"
            "  hint: did you mean 'pos_meas1'?");
  EXPECT_EQ(ResolveError("joint1.q=2*pos_maes1", {"t", "pos_meas1", "vel"}),
            "--columns: run.csv has no column 'pos_maes1' (for 'joint1.q', "
            "character 3 of '2*pos_maes1')\n"
            "  hint: did you mean 'pos_meas1'?");
  EXPECT_EQ(ResolveError("joint1.q=zzz", {"t", "a"}),
            "--columns: run.csv has no column 'zzz' (for 'joint1.q')\n"
            "  hint: known: t, a");
  EXPECT_EQ(ResolveError("joint1.q=run-2", {"t", "run-1"}),
            "--columns: run.csv has no column 'run-2' (for 'joint1.q')\n"
            "  hint: did you mean 'run-1'?");
}

TEST(ColumnMapTest, ReportsAnExpressionThatIsNone) {
  EXPECT_EQ(ResolveError("joint1.q=pos*", {"t", "pos"}),
            "--columns: a column, a number or '(' is expected at its end (for "
            "'joint1.q', character 5 of 'pos*')\n"
            "  hint: write column*number, (column-90)*0.0174532925 or "
            "column1-column2; put odd names in quotes");
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
            "  hint: its columns are joint1.q, joint1.qd, joint1.motor_q, "
            "joint1.tau");
  EXPECT_EQ(ResolveError("tip_joint.q=pos", {"t", "pos"}),
            "--columns: joint 'tip_joint' is fixed and has no column "
            "'tip_joint.q'\n"
            "  hint: leave the column out; if the joint moves, give it "
            "another type in the URDF (revolute, ...)");
}

}  // namespace
}  // namespace sysid
