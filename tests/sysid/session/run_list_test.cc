#include "sysid/session/run_list.h"

#include <gmock/gmock.h>

#include <filesystem>

#include "tests/support/error_text.h"
#include "tests/support/program_folder.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class RunListTest : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const char* const run : {"b/2.csv", "b/1.csv", "a/1.csv", "a/x.txt"}) {
      const std::filesystem::path path = folder_.Path(run);
      std::filesystem::create_directories(path.parent_path());
      folder_.Write(run, "t\n");
    }
  }
  std::string At(const std::string& name) const { return folder_.Path(name); }
  // The text of the error of one entry.
  static std::string Error(const std::string& entry) {
    return ErrorText([&] { ExpandRuns({entry}, "--traj"); });
  }

  ProgramFolder folder_;
};

TEST_F(RunListTest, FilesStandAsTheyAreGiven) {
  EXPECT_THAT(ExpandRuns({}, "--traj"), IsEmpty());
  EXPECT_THAT(ExpandRuns({"b.csv", "nowhere/a.csv"}, "--traj"),
              ElementsAre("b.csv", "nowhere/a.csv"));
}

TEST_F(RunListTest, APatternStandsForItsFilesSorted) {
  EXPECT_THAT(
      ExpandRuns({"z.csv", At("?/*.csv")}, "--traj"),
      ElementsAre("z.csv", At("a/1.csv"), At("b/1.csv"), At("b/2.csv")));
  EXPECT_THAT(ExpandRuns({At("b/[2-9].csv")}, "--traj"),
              ElementsAre(At("b/2.csv")));
}

TEST_F(RunListTest, AFileWhoseNameIsAPatternIsThatFile) {
  folder_.Write("b/[1].csv", "t\n");
  EXPECT_THAT(ExpandRuns({At("b/[1].csv")}, "--traj"),
              ElementsAre(At("b/[1].csv")));
}

TEST_F(RunListTest, APatternWithoutAMatchIsAnError) {
  EXPECT_EQ(Error("nowhere/*.csv"),
            "--traj: no file matches 'nowhere/*.csv'\n  hint: patterns are * ? "
            "[..] as in a shell; relative ones begin in the current folder");
}

TEST_F(RunListTest, AListNamesRunsRelativeToItself) {
  folder_.Write("b/runs.txt",
                "# the second machine\n\n2.csv # after the repair\r\n"
                "  ../a/*.csv\n/abs/run#3.csv\n");
  EXPECT_THAT(
      ExpandRuns({"@" + At("b/runs.txt"), "last.csv"}, "--traj"),
      ElementsAre(At("b/2.csv"), At("a/1.csv"), "/abs/run#3.csv", "last.csv"));
}

TEST_F(RunListTest, AListMayBeFromAnotherSystem) {
  folder_.Write("runs.txt", "\xEF\xBB\xBF/1.csv\r\n\r\n/2.csv\r\n");
  EXPECT_THAT(ExpandRuns({"@" + At("runs.txt")}, "--traj"),
              ElementsAre("/1.csv", "/2.csv"));
}

TEST_F(RunListTest, AListThatCannotBeUsedIsAnError) {
  const std::string hint =
      "\n  hint: @FILE is a text file that names a recording in each line";
  EXPECT_EQ(Error("@nowhere.txt"),
            "--traj: the list '@nowhere.txt' is not there" + hint);
  EXPECT_EQ(Error("@"), "--traj: the list '@' names no file" + hint);
  EXPECT_EQ(Error("@" + At("b")),
            "--traj: the list '@" + At("b") + "' is a folder" + hint);
  folder_.Write("empty.txt", "# none yet\n");
  EXPECT_EQ(Error("@" + At("empty.txt")),
            "--traj: the list '@" + At("empty.txt") +
                "' names no recording\n  hint: write a file's name in each "
                "line");
  folder_.Write("lists.txt", "1.csv\n@b/runs.txt\n");
  EXPECT_EQ(Error("@" + At("lists.txt")),
            At("lists.txt") +
                ":2: '@b/runs.txt' is a list within a list\n  hint: name its "
                "recordings here, or both lists on the flag");
  folder_.Write("none.txt", "\n*.bag\n");
  EXPECT_EQ(Error("@" + At("none.txt")),
            At("none.txt") + ":2: no file matches '" + At("*.bag") +
                "'\n  hint: patterns are * ? [..] as in a shell; relative ones "
                "begin in the folder of the list");
  folder_.Write("binary", std::string("a\0b\n", 4));
  EXPECT_EQ(Error("@" + At("binary")),
            At("binary") +
                ":1: is not text\n  hint: is it a recording? Name recordings "
                "without the @");
}

}  // namespace
}  // namespace sysid
