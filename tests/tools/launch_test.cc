// What a package has in bin/ (scripts/package), beside stubs of the programs.

#include <gmock/gmock.h>

#include <filesystem>

#include "tests/support/program_folder.h"

namespace sysid {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class LaunchTest : public ::testing::Test {
 protected:
  LaunchTest() { fs::copy_file(SYSID_LAUNCH, folder_.Path("fit")); }

  // A program that says its name and its arguments.
  void WriteStub(const std::string& name) {
    folder_.Write(name, "#!/bin/sh\necho " + name + " \"$@\"\nexit 7\n");
    fs::permissions(folder_.Path(name), fs::perms::owner_all);
  }
  void WriteStubs() {
    for (const std::string level : {"x86-64", "x86-64-v3", "x86-64-v4"}) {
      WriteStub("fit." + level);
    }
  }

  // The newest of them that the dynamic loader knows the processor to have.
  std::string LevelOfLoader() {
    const std::string loader = "/lib64/ld-linux-x86-64.so.2";
    const std::string help = folder_.Run(loader, {"--help"}).out;
    for (const std::string level : {"x86-64-v4", "x86-64-v3"}) {
      if (help.find(level + " (supported") != std::string::npos) return level;
    }
    return "x86-64";
  }

  ProgramFolder folder_;
};

TEST_F(LaunchTest, RunsTheNewestThatTheProcessorHas) {
  WriteStubs();
  const ProgramResult result =
      folder_.Run(folder_.Path("fit"), {"--model", "a b"});
  EXPECT_EQ(result.exit_code, 7);
  EXPECT_EQ(result.out, "fit." + LevelOfLoader() + " --model a b\n");
}

TEST_F(LaunchTest, FindsThemFromALinkOfAnotherName) {
  WriteStubs();
  fs::create_symlink(folder_.Path("fit"), folder_.Path("link"));
  const ProgramResult result = folder_.Run(folder_.Path("link"), {});
  EXPECT_THAT(result.out, HasSubstr("fit." + LevelOfLoader()));
}

TEST_F(LaunchTest, SaysWhatIsMissing) {
  const ProgramResult result = folder_.Run(folder_.Path("fit"), {});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("fit." + LevelOfLoader()));
  EXPECT_THAT(result.err, HasSubstr("No such file or directory"));
}

}  // namespace
}  // namespace sysid
