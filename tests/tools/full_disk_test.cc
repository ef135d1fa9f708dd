// A disk that is full or fills up, a folder that may not be written to, a pipe
// that closes (docs/robustness.md).

#include <sched.h>
#include <sys/mount.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "tests/support/running_program.h"
#include "tests/tools/survival.h"

namespace sysid {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

using FullDiskTest = SurvivalTest;

// A file system of that size, that this process alone sees. False where that is
// not permitted.
bool MountSmall(const std::string& path, const std::string& options) {
  fs::create_directories(path);
  return unshare(CLONE_NEWNS) == 0 &&
         mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
         mount("none", path.c_str(), "tmpfs", 0, options.c_str()) == 0;
}

#define SKIP_WITHOUT_MOUNT(mounted) \
  if (!(mounted)) GTEST_SKIP() << "no right to mount a file system"

void FillTo(const std::string& path, size_t free_bytes) {
  const fs::space_info space = fs::space(fs::path(path).parent_path());
  ASSERT_GT(space.available, free_bytes);
  std::ofstream(path) << std::string(space.available - free_bytes, 'x');
}

TEST_F(FullDiskTest, FullDiskIsNamedAndTheResultStillPrinted) {
  const std::string disk = folder_.Path("disk");
  SKIP_WITHOUT_MOUNT(MountSmall(disk, "size=256k"));
  const std::string older(1000, 'o');
  folder_.Write("disk/prediction.csv", older);
  // Enough for the test of the folder, and for fit.json.
  FillTo(disk + "/filler", 40'000);
  const Files before = folder_.Contents();
  const ProgramResult fit =
      folder_.Run(SYSID_FIT, Model() + Arguments{"--out", "disk"});
  EXPECT_EQ(fit.exit_code, 2);
  EXPECT_THAT(fit.err, HasSubstr("error: disk/"));
  EXPECT_THAT(fit.err,
              HasSubstr("cannot be written: No space left on device\n  hint: "
                        "the disk is full"));
  EXPECT_THAT(fit.out, HasSubstr("link1.length"));
  EXPECT_EQ(fit.out.find("written to"), std::string::npos);
  for (const auto& [name, text] : folder_.Contents()) {
    EXPECT_FALSE(IsTemporary(name)) << name;
    const auto at = before.find(name);
    if (at != before.end()) {
      EXPECT_EQ(text, at->second) << name;
    } else {
      ExpectWhole(name, text);
    }
  }
  const ProgramResult run =
      folder_.Run(SYSID_SIMULATE, {"--model", "pendulum1", "--duration", "100",
                                   "--out_csv", "disk/run.csv"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("disk/run.csv: cannot be written: No space"));
  EXPECT_FALSE(folder_.Has("disk/run.csv"));
}

TEST_F(FullDiskTest, DiskThatIsFullAlreadyIsRefusedBeforeTheFit) {
  const std::string disk = folder_.Path("disk");
  SKIP_WITHOUT_MOUNT(MountSmall(disk, "size=64k"));
  FillTo(disk + "/filler", 0);
  // Never done within the work of a test (limits.h), were it begun.
  const Arguments endless =
      Model() + Arguments{"--solver", "adam", "--epochs", "1000000"};
  for (const Arguments& where :
       {Arguments{"--out", "disk"}, Arguments{"--json", "disk/fit.json"}}) {
    const std::string place = where[0] == "--out" ? "--out" : where[1];
    ExpectRefused(folder_, SYSID_FIT, endless + where, place,
                  "No space left on device", "the disk is full");
  }
}

TEST_F(FullDiskTest, ReadOnlyFolderIsRefusedBeforeAnyWork) {
  const std::string disk = folder_.Path("disk");
  SKIP_WITHOUT_MOUNT(MountSmall(disk, "size=64k"));
  ASSERT_EQ(
      mount("none", disk.c_str(), "tmpfs", MS_REMOUNT | MS_RDONLY, nullptr), 0);
  const std::string why = "Read-only file system", hint = "choose a folder";
  Arguments joint = Model(), alone = Model();
  alone.erase(alone.begin() + 4, alone.begin() + 6);  // no --holdout
  const auto refused = [&](const std::string& program, const Arguments& model,
                           const std::string& flag, const std::string& file) {
    ExpectRefused(folder_, program, model + Arguments{flag, file},
                  flag == "--out" ? flag : file, why, hint);
  };
  const Arguments endless =
      joint + Arguments{"--solver", "adam", "--epochs", "1000000"};
  refused(SYSID_FIT, endless, "--out", "disk");
  refused(SYSID_FIT, endless, "--json", "disk/fit.json");
  refused(SYSID_DIAGNOSE, joint, "--out", "disk");
  refused(SYSID_DIAGNOSE, joint, "--json", "disk/diagnosis.json");
  refused(SYSID_SIMULATE, {"--model", "pendulum1", "--duration", "1e5"},
          "--out_csv", "disk/run.csv");
#ifdef SYSID_HAVE_STAN
  const Arguments many = alone + Arguments{"--repeat", "10000"};
  refused(SYSID_COMPARE, many, "--out", "disk");
  refused(SYSID_COMPARE, many, "--json", "disk/comparison.json");
  refused(SYSID_COMPARE, many, "--figure", "disk/figure.svg");
#endif
#ifdef SYSID_STUDIO
  refused(SYSID_STUDIO, joint + Arguments{"--port", "0"}, "--out", "disk");
#endif
}

TEST_F(FullDiskTest, FileThatMayNotGrowIsAnError) {
  const ProgramResult run =
      folder_.Run("/bin/sh", {"-c", "ulimit -f 8; exec \"$0\" \"$@\"",
                              SYSID_SIMULATE, "--model", "pendulum1",
                              "--duration", "100", "--out_csv", "long.csv"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err,
              HasSubstr("long.csv: cannot be written: File too large"));
  EXPECT_FALSE(folder_.Has("long.csv"));
}

// `| head -1`: the program ends by SIGPIPE, silently, or is done already; what
// it writes to files is there.
TEST_F(FullDiskTest, PipeThatClosesIsNoCrash) {
  RunningProgram fit(folder_, SYSID_FIT, Model() + Arguments{"--out", "fit"});
  fit.ClosePipe();
  EXPECT_EQ(fit.Await(), 128 + SIGPIPE);
  EXPECT_THAT(fit.Errors(), ::testing::EndsWith(NoReportNote()));
  ExpectWhole("fit.json", folder_.Read("fit/fit.json"));
  RunningProgram run(
      folder_, SYSID_SIMULATE,
      {"--model", "pendulum1", "--duration", "1000", "--out_csv", "-"});
  EXPECT_EQ(run.Line(), "# sysid_simulate --model pendulum1 --duration 1000");
  run.ClosePipe();
  EXPECT_EQ(run.Await(), 128 + SIGPIPE);
  EXPECT_EQ(run.Errors(), "");
}

}  // namespace
}  // namespace sysid
