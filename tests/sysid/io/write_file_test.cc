#include "sysid/io/write_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/support/error_text.h"

namespace sysid {
namespace {

namespace fs = std::filesystem;

// A folder of its own, removed at the end.
class WriteFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) /
              (std::string("write_file_test_") + info->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string Path(const std::string& name) const {
    return (folder_ / name).string();
  }
  static std::string Read(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  }
  int Files() const {
    return static_cast<int>(std::distance(fs::directory_iterator(folder_),
                                          fs::directory_iterator()));
  }

  fs::path folder_;
};

TEST_F(WriteFileTest, WritesAndReplaces) {
  WriteFileAtomically(Path("a"), "one");
  EXPECT_EQ(Read(Path("a")), "one");
  WriteFileAtomically(Path("a"), "two");
  EXPECT_EQ(Read(Path("a")), "two");
  EXPECT_EQ(Files(), 1);
}

TEST_F(WriteFileTest, FollowsSymbolicLinks) {
  WriteFileAtomically(Path("a"), "one");
  fs::create_symlink("a", folder_ / "link");
  WriteFileAtomically(Path("link"), "two");
  EXPECT_EQ(Read(Path("a")), "two");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
}

TEST_F(WriteFileTest, LeavesDevicesWhereTheyAre) {
  WriteFileAtomically("/dev/null", "gone");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  CheckWritableFile("/dev/null");
}

TEST_F(WriteFileTest, ReportsAFullDevice) {
  EXPECT_EQ(ErrorText([] { WriteFileAtomically("/dev/full", "x"); }),
            "/dev/full: cannot be written: No space left on device");
}

TEST_F(WriteFileTest, ReportsAFolderThatIsNotThere) {
  const std::string path = Path("no/a");
  const std::string text = path +
                           ": cannot be written: No such file or directory\n"
                           "  hint: make the folder '" +
                           Path("no") + "' first";
  EXPECT_EQ(ErrorText([&] { WriteFileAtomically(path, "x"); }), text);
  EXPECT_EQ(ErrorText([&] { CheckWritableFile(path); }), text);
}

TEST_F(WriteFileTest, ReportsAPathThroughAFile) {
  WriteFileAtomically(Path("a"), "one");
  const std::string path = Path("a/b");
  const std::string reason =
      "Not a directory\n"
      "  hint: a part of the path is a file, not a folder";
  EXPECT_EQ(ErrorText([&] { WriteFileAtomically(path, "x"); }),
            path + ": cannot be written: " + reason);
  EXPECT_EQ(ErrorText([&] { CheckWritableFile(path); }),
            path + ": cannot be written: " + reason);
  EXPECT_EQ(ErrorText([&] { CheckWritableFolder(path); }),
            path + ": the folder cannot be made: " + reason);
  EXPECT_EQ(ErrorText([&] { CheckWritableFolder(Path("a")); }),
            Path("a") + ": the folder cannot be made: " + reason);
}

TEST_F(WriteFileTest, ReportsAFolderInPlaceOfAFile) {
  const std::string text =
      folder_.string() +
      ": cannot be written: Is a directory\n  hint: name a file in it";
  EXPECT_EQ(ErrorText([&] { WriteFileAtomically(folder_.string(), "x"); }),
            text);
  EXPECT_EQ(ErrorText([&] { CheckWritableFile(folder_.string()); }), text);
}

TEST_F(WriteFileTest, ReportsAFolderThatTakesNoFiles) {
  EXPECT_EQ(ErrorText([] { CheckWritableFolder("/proc"); }),
            "/proc: files cannot be written into the folder: No such file or "
            "directory\n"
            "  hint: choose a folder that you may write to");
  EXPECT_EQ(ErrorText([] { CheckWritableFolder("/proc/out"); }),
            "/proc/out: the folder cannot be made: No such file or directory\n"
            "  hint: make the folder '/proc' first");
}

TEST_F(WriteFileTest, MakesFoldersWithTheirParents) {
  CheckWritableFolder(Path("a/b/c"));
  CheckWritableFolder(Path("a/b/c/"));
  EXPECT_TRUE(fs::is_empty(folder_ / "a/b/c"));
}

TEST_F(WriteFileTest, ChecksWithoutLeavingAnything) {
  CheckWritableFile(Path("a"));
  EXPECT_EQ(Files(), 0);
  WriteFileAtomically(Path("a"), "one");
  CheckWritableFile(Path("a"));
  EXPECT_EQ(Read(Path("a")), "one");
  EXPECT_EQ(Files(), 1);
}

// What a program left that was killed between giving a file its temporary name
// and its own.
TEST_F(WriteFileTest, ChecksRemoveWhatKilledWritersLeft) {
  const auto make = [&](const std::string& name, bool old) {
    WriteFileAtomically(Path(name), "x");
    if (!old) return;
    fs::last_write_time(
        Path(name), fs::file_time_type::clock::now() - std::chrono::minutes(1));
  };
  make("fit.json.sysid-part-123-4", true);
  make("other.csv.sysid-part-1-0", true);
  make("young.csv.sysid-part-1-0", false);  // perhaps another's that begins
  make("mine.sysid-part-list", true);
  make("run.csv", true);
  make("locked.sysid-part-5-6", true);
  const int locked =
      open(Path("locked.sysid-part-5-6").c_str(), O_RDONLY | O_CLOEXEC);
  ASSERT_EQ(flock(locked, LOCK_EX), 0);  // its writer lives
  CheckWritableFolder(folder_.string());
  EXPECT_FALSE(fs::exists(Path("fit.json.sysid-part-123-4")));
  EXPECT_FALSE(fs::exists(Path("other.csv.sysid-part-1-0")));
  EXPECT_TRUE(fs::exists(Path("young.csv.sysid-part-1-0")));
  EXPECT_TRUE(fs::exists(Path("mine.sysid-part-list")));
  EXPECT_TRUE(fs::exists(Path("run.csv")));
  EXPECT_TRUE(fs::exists(Path("locked.sysid-part-5-6")));
  close(locked);
  CheckWritableFile(Path("run.csv"));
  EXPECT_FALSE(fs::exists(Path("locked.sysid-part-5-6")));
  EXPECT_EQ(Files(), 3);
}

TEST_F(WriteFileTest, ReportsANameThatIsEmpty) {
  EXPECT_EQ(ErrorText([] { WriteFileAtomically("", "x"); }),
            "a file without a name");
  EXPECT_EQ(ErrorText([] { CheckWritableFile(""); }), "a file without a name");
  EXPECT_EQ(ErrorText([] { CheckWritableFolder(""); }),
            "a folder without a name");
}

}  // namespace
}  // namespace sysid
