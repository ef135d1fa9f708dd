#include "sysid/session/gather_notices.h"

#include <gmock/gmock.h>

namespace sysid {
namespace {

using ::testing::ElementsAre;

std::vector<std::string> Runs(int count) {
  std::vector<std::string> runs;
  for (int i = 1; i <= count; ++i) {
    runs.push_back("runs/" + std::to_string(i) + ".csv");
  }
  return runs;
}

TEST(GatherNotices, LeavesAFewRunsAsTheyAre) {
  const std::vector<std::string> notices = {
      "runs/1.csv: ignored the column a", "runs/2.csv: ignored the column a",
      "runs/3.csv: ignored the column a", "no effort is recorded of joint2"};
  EXPECT_EQ(GatherNotices(notices, Runs(9)), notices);
}

TEST(GatherNotices, SaysOnceWhatManyRunsHave) {
  std::vector<std::string> notices = {"3 joints are held still"};
  for (const std::string& run : Runs(9)) {
    notices.push_back(run + ": ignored the column a: b");
  }
  notices.push_back("runs/4.csv: a gap of 0.2 s");
  notices.push_back("no effort is recorded of joint2");
  EXPECT_THAT(GatherNotices(notices, Runs(9)),
              ElementsAre("3 joints are held still",
                          "runs/1.csv and 8 more runs: ignored the column a: b",
                          "runs/4.csv: a gap of 0.2 s",
                          "no effort is recorded of joint2"));
}

TEST(GatherNotices, CountsWhatIsBeyondADozen) {
  std::vector<std::string> notices;
  int seconds = 0;
  for (const std::string& run : Runs(30)) {
    for (const std::string gap : {"a", "b"}) {
      notices.push_back(run + ": column " + gap + " has a gap of " +
                        std::to_string(++seconds) + " s");
    }
  }
  notices.push_back("no effort is recorded of joint2");
  const auto gathered = GatherNotices(notices, Runs(30));
  ASSERT_EQ(gathered.size(), 14u);
  EXPECT_EQ(gathered[0], notices[0]);
  EXPECT_EQ(gathered[11], notices[11]);
  EXPECT_EQ(gathered[12], "48 more notices of 24 runs: --json FILE has all");
  EXPECT_EQ(gathered[13], notices.back());
}

// "run.csv" is the beginning of another run's name.
TEST(GatherNotices, KnowRunsByTheirWholeNames) {
  const std::vector<std::string> runs = {"a", "a: b", "c", "d"};
  EXPECT_THAT(GatherNotices({"a: b: x", "c: x", "d: x", "a: y"}, runs),
              ElementsAre("a: b and 2 more runs: x", "a: y"));
}

}  // namespace
}  // namespace sysid
