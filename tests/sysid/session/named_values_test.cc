#include "sysid/session/named_values.h"

#include <gmock/gmock.h>

#include "tests/support/error_text.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(SplitList, SplitsAtCommasAndDropsTheSpacesAround) {
  EXPECT_THAT(SplitList("a, b c ,d", "--x"), ElementsAre("a", "b c", "d"));
  EXPECT_THAT(SplitList("a", "--x"), ElementsAre("a"));
  EXPECT_THAT(SplitList("", "--x"), IsEmpty());
  EXPECT_THAT(SplitList(" \t", "--x"), IsEmpty());
}

TEST(SplitList, RefusesEmptyEntries) {
  for (const std::string text : {"a,", ",a", "a,,b", "a, ,b", ","}) {
    EXPECT_EQ(ErrorText([&] { SplitList(text, "--x"); }),
              "--x: has an empty entry: '" + text +
                  "'\n  hint: separate entries by single commas");
  }
}

// Files may be called anything.
TEST(SplitList, SplitsAtEveryComma) {
  EXPECT_THAT(SplitList("@runs.txt,a(1.csv,b@c.csv,d.csv", "--traj"),
              ElementsAre("@runs.txt", "a(1.csv", "b@c.csv", "d.csv"));
}

TEST(SplitEffects, KeepsLawsAndPairsTogether) {
  EXPECT_THAT(SplitEffects("a@b, custom@j: -min(k*q, c) + x, d@e", "--add"),
              ElementsAre("a@b", "custom@j: -min(k*q, c) + x", "d@e"));
  EXPECT_THAT(SplitEffects("custom@j: -k*q; -b*qd^3 ;", "--candidates"),
              ElementsAre("custom@j: -k*q", "custom@j: -b*qd^3"));
  EXPECT_THAT(SplitEffects("gear_coupling@a,b,c@d", "--add"),
              ElementsAre("gear_coupling@a,b", "c@d"));
  EXPECT_THAT(SplitEffects("gear_coupling@a+b,c@d", "--add"),
              ElementsAre("gear_coupling@a+b", "c@d"));
  // No more than a pair, and not behind a number.
  EXPECT_THAT(SplitEffects("x@a,b,c", "--add"), ElementsAre("x@a,b", "c"));
  EXPECT_THAT(SplitEffects("x@a=1,b", "--add"), ElementsAre("x@a=1", "b"));
  EXPECT_THAT(SplitEffects("a,b@c", "--add"), ElementsAre("a", "b@c"));
}

TEST(SplitAssignments, ReadsNamesWithAndWithoutNumbers) {
  const std::vector<NamedValue> values =
      SplitAssignments("a=1.5, b ,c = -2e-3,d=+4", "--x");
  ASSERT_EQ(values.size(), 4u);
  EXPECT_EQ(values[0].name, "a");
  EXPECT_EQ(values[0].value, 1.5);
  EXPECT_EQ(values[0].place, "--x");
  EXPECT_EQ(values[1].name, "b");
  EXPECT_FALSE(values[1].value.has_value());
  EXPECT_EQ(values[2].name, "c");
  EXPECT_EQ(values[2].value, -2e-3);
  EXPECT_EQ(values[3].value, 4.0);
}

TEST(SplitAssignments, RefusesWhatIsNoFiniteNumber) {
  for (const std::string text : {"", "heavy", "nan", "inf", "1e999"}) {
    EXPECT_EQ(ErrorText([&] { SplitAssignments("a=" + text, "--x"); }),
              "--x: '" + text + "' is not a number, in 'a=" + text +
                  "'\n  hint: write name=number, in SI units");
  }
}

TEST(SplitAssignments, RefusesANameThatComesTwice) {
  for (const std::string text : {"a,a", "a=1,b,a=2", "a, a =1"}) {
    EXPECT_EQ(ErrorText([&] { SplitAssignments(text, "--x"); }),
              "--x: 'a' is named twice\n  hint: name it once");
  }
}

}  // namespace
}  // namespace sysid
