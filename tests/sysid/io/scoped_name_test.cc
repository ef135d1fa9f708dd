#include "sysid/io/scoped_name.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace sysid {
namespace {

struct Split {
  std::string text, run, name;
};

// Names have slashes too, and so have paths: what is a name decides.
TEST(ScopedNameTest, SplitsBeforeAName) {
  const auto is_name = [](const std::string& name) {
    return name == "joint1.q" || name == "robot/joint1.q";
  };
  const std::vector<Split> splits = {
      {"joint1.q", "", "joint1.q"},
      {"b.csv/joint1.q", "b.csv", "joint1.q"},
      {"runs/b.csv/joint1.q", "runs/b.csv", "joint1.q"},
      {"robot/joint1.q", "", "robot/joint1.q"},
      {"runs/b.csv/robot/joint1.q", "runs/b.csv", "robot/joint1.q"},
      {"jiont1.q", "", "jiont1.q"},
      {"runs/b.csv/jiont1.q", "runs/b.csv", "jiont1.q"},
      {"/", "", ""},
  };
  for (const Split& split : splits) {
    const ScopedName scoped = SplitScope(split.text, is_name);
    EXPECT_EQ(scoped.run, split.run) << split.text;
    EXPECT_EQ(scoped.name, split.name) << split.text;
  }
}

TEST(ScopedNameTest, IsForItsRun) {
  EXPECT_TRUE((ScopedName{"", "t"}).IsFor("runs/a.csv"));
  EXPECT_TRUE((ScopedName{"a.csv", "t"}).IsFor("runs/a.csv"));
  EXPECT_TRUE((ScopedName{"runs/a.csv", "t"}).IsFor("runs/a.csv"));
  EXPECT_FALSE((ScopedName{"b.csv", "t"}).IsFor("runs/a.csv"));
  EXPECT_FALSE((ScopedName{"other/a.csv", "t"}).IsFor("runs/a.csv"));
}

}  // namespace
}  // namespace sysid
