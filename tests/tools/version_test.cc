// --version of every program: SYSID_VERSION is the project's.

#include <filesystem>

#include "tests/tools/programs.h"

namespace sysid {
namespace {

TEST(VersionTest, IsPrintedByEveryProgram) {
  const ProgramFolder folder;
  Arguments programs = {SYSID_CHECK, SYSID_COMPARE, SYSID_DIAGNOSE,
                        SYSID_FIT,   SYSID_FLEET,   SYSID_SIMULATE};
#ifdef SYSID_STUDIO
  programs.push_back(SYSID_STUDIO);
#endif
  for (const std::string& program : programs) {
    // Whatever comes behind it, as with --help.
    const ProgramResult result = folder.Run(program, {"--version", "--model"});
    const std::string begin =
        std::filesystem::path(program).filename().string() + " " +
        SYSID_VERSION;
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.err, "");
    ASSERT_THAT(result.out, ::testing::StartsWith(begin));
    EXPECT_THAT(
        result.out.substr(begin.size()),
        ::testing::MatchesRegex("( \\(commit [0-9a-f]{7,40}(-dirty)?\\))?\n"));
  }
  EXPECT_TRUE(folder.Contents().empty());
}

}  // namespace
}  // namespace sysid
