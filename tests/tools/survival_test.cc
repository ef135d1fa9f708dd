// The programs killed at a hundred random moments, on a full disk, in a folder
// that may not be written to: every file is whole or absent, and what was there
// before is as it was (docs/robustness.md).

#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "tests/support/running_program.h"
#include "tests/tools/programs.h"

namespace sysid {
namespace {

namespace fs = std::filesystem;
using std::chrono::microseconds;
using ::testing::HasSubstr;
using Json = nlohmann::json;
using Files = std::map<std::string, std::string>;

bool IsTemporary(const std::string& name) {
  return name.find(".sysid-part-") != std::string::npos;
}

// Whether a file that a program wrote ends as it must.
void ExpectWhole(const std::string& name, const std::string& text) {
  SCOPED_TRACE(name);
  ASSERT_FALSE(text.empty());
  if (name.ends_with(".json")) {
    const Json json = Json::parse(text, nullptr, false);
    ASSERT_TRUE(json.is_object());
    EXPECT_TRUE(json.contains("schema"));
  } else if (name.ends_with(".csv")) {
    EXPECT_EQ(text.back(), '\n');
  } else if (name.ends_with(".urdf")) {
    EXPECT_THAT(text, ::testing::EndsWith("</robot>\n"));
  } else if (name.ends_with(".svg")) {
    EXPECT_THAT(text, ::testing::EndsWith("</svg>\n"));
  } else if (name.ends_with(".html")) {
    EXPECT_THAT(text.substr(text.size() - 20), HasSubstr("</html>"));
  }
}

long Lines(const std::string& text) {
  return std::count(text.begin(), text.end(), '\n');
}

class SurvivalTest : public ::testing::Test {
 protected:
  SurvivalTest() {
    for (const auto& [name, seed] :
         {std::pair("run.csv", "1"), std::pair("other.csv", "2")}) {
      SimulateInto(
          folder_, name,
          {"--model", "pendulum2_planar", "--add",
           "coulomb_friction@joint1=0.05", "--seed", seed, "--duration", "4"});
    }
  }
  Arguments Model() const {
    return {"--model",   "pendulum2_planar",
            "--traj",    "run.csv",
            "--holdout", "other.csv",
            "--free",    "link1.length=0.4,link2.length=0.4"};
  }

  // Kills the program at `times` moments of its life, which the first, whole
  // run measures: half of them in its last tenth, where it writes.
  void KillAtRandom(const std::string& program, const Arguments& arguments,
                    int times) {
    const auto start = std::chrono::steady_clock::now();
    const ProgramResult whole = folder_.Run(program, arguments);
    // 1: so few epochs reach nothing, which is of no interest here.
    ASSERT_LE(whole.exit_code, 1) << whole.err;
    const double life = std::chrono::duration<double, std::micro>(
                            std::chrono::steady_clock::now() - start)
                            .count();
    const Files before = folder_.Contents();
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    for (int i = 0; i < times; ++i) {
      const double part =
          i % 2 == 0 ? uniform(random) : 0.9 + 0.15 * uniform(random);
      RunningProgram running(folder_, program, arguments);
      std::this_thread::sleep_for(microseconds(static_cast<long>(part * life)));
      running.End(SIGKILL);
      ExpectAllWhole(before);
      if (HasFailure()) return;
    }
    // The next run is not disturbed, and clears away what is left.
    Age();
    EXPECT_EQ(folder_.Run(program, arguments).exit_code, whole.exit_code);
    for (const auto& [name, text] : folder_.Contents()) {
      EXPECT_FALSE(IsTemporary(name)) << name;
    }
  }

  void ExpectAllWhole(const Files& before) const {
    const Files now = folder_.Contents();
    for (const auto& [name, text] : now) {
      if (IsTemporary(name) || name.ends_with("/")) continue;
      ExpectWhole(name, text);
      const auto at = before.find(name);
      ASSERT_NE(at, before.end()) << name << " is no file of a whole run";
      // The same work gives as many rows.
      if (name.ends_with(".csv")) {
        EXPECT_EQ(Lines(text), Lines(at->second));
      }
    }
    for (const auto& [name, text] : before) {
      EXPECT_TRUE(now.contains(name)) << name << " was lost";
    }
  }

  // Lets what was abandoned look old: the programs spare what may be another's
  // that begins.
  void Age() const {
    for (const auto& entry :
         fs::recursive_directory_iterator(folder_.Path(""))) {
      if (!IsTemporary(entry.path().filename().string())) continue;
      fs::last_write_time(
          entry, fs::file_time_type::clock::now() - std::chrono::minutes(1));
    }
  }

  ProgramFolder folder_;
};

TEST_F(SurvivalTest, KilledFitLeavesWholeFiles) {
  KillAtRandom(SYSID_FIT, Model() + Arguments{"--out", "fit"}, 30);
}

TEST_F(SurvivalTest, KilledDiagnosisLeavesWholeFiles) {
  KillAtRandom(SYSID_DIAGNOSE,
               Model() + Arguments{"--candidates", "coulomb_friction", "--auto",
                                   "--out", "diagnosis"},
               20);
}

TEST_F(SurvivalTest, KilledSimulationLeavesAWholeRun) {
  KillAtRandom(SYSID_SIMULATE,
               {"--model", "pendulum2_planar", "--duration", "60", "--rate",
                "1000", "--out_csv", "simulated.csv"},
               20);
}

#ifdef SYSID_HAVE_STAN
TEST_F(SurvivalTest, KilledComparisonLeavesWholeFiles) {
  Arguments model = Model();
  model.erase(model.begin() + 4, model.begin() + 6);  // no --holdout
  KillAtRandom(SYSID_COMPARE,
               model + Arguments{"--epochs", "60", "--out", "comparison"}, 15);
}
#endif

#ifdef SYSID_STUDIO
// It ends only by a signal. The next one continues what was saved.
TEST_F(SurvivalTest, KilledStudioLeavesASessionThatContinues) {
  const Arguments arguments =
      Model() + Arguments{"--candidates", "coulomb_friction", "--port", "0",
                          "--out",        "session"};
  std::mt19937_64 random(7);
  std::uniform_int_distribution<long> moment(0, 3'000'000);
  for (int i = 0; i < 15; ++i) {
    RunningProgram studio(folder_, SYSID_STUDIO, arguments);
    std::this_thread::sleep_for(microseconds(moment(random)));
    studio.End(SIGKILL);
    for (const auto& [name, text] : folder_.Contents()) {
      if (IsTemporary(name) || name.ends_with("/")) continue;
      ExpectWhole(name, text);
    }
    if (HasFailure()) return;
  }
  Age();
  RunningProgram studio(folder_, SYSID_STUDIO, arguments);
  EXPECT_THAT(studio.Line(), ::testing::StartsWith("http://127.0.0.1:"));
  EXPECT_EQ(studio.End(SIGTERM), 0) << studio.Errors();
  for (const auto& [name, text] : folder_.Contents()) {
    EXPECT_FALSE(IsTemporary(name)) << name;
  }
}
#endif

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

TEST_F(SurvivalTest, FullDiskIsNamedAndTheResultStillPrinted) {
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
  const ProgramResult run = folder_.Run(
      SYSID_SIMULATE,
      {"--model", "arm7", "--duration", "100", "--out_csv", "disk/run.csv"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("disk/run.csv: cannot be written: No space"));
  EXPECT_FALSE(folder_.Has("disk/run.csv"));
}

TEST_F(SurvivalTest, DiskThatIsFullAlreadyIsRefusedBeforeTheFit) {
  const std::string disk = folder_.Path("disk");
  SKIP_WITHOUT_MOUNT(MountSmall(disk, "size=64k"));
  FillTo(disk + "/filler", 0);
  // Never done within the two minutes of a test, were it begun.
  const Arguments endless =
      Model() + Arguments{"--solver", "adam", "--epochs", "1000000"};
  for (const Arguments& where :
       {Arguments{"--out", "disk"}, Arguments{"--json", "disk/fit.json"}}) {
    ExpectRefused(folder_, SYSID_FIT, endless + where, where[1],
                  "No space left on device", "the disk is full");
  }
}

TEST_F(SurvivalTest, ReadOnlyFolderIsRefusedBeforeAnyWork) {
  const std::string disk = folder_.Path("disk");
  SKIP_WITHOUT_MOUNT(MountSmall(disk, "size=64k"));
  ASSERT_EQ(
      mount("none", disk.c_str(), "tmpfs", MS_REMOUNT | MS_RDONLY, nullptr), 0);
  const std::string why = "Read-only file system", hint = "choose a folder";
  Arguments joint = Model(), alone = Model();
  alone.erase(alone.begin() + 4, alone.begin() + 6);  // no --holdout
  const auto refused = [&](const std::string& program, const Arguments& model,
                           const std::string& flag, const std::string& file) {
    ExpectRefused(folder_, program, model + Arguments{flag, file}, file, why,
                  hint);
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

TEST_F(SurvivalTest, FileThatMayNotGrowIsAnError) {
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
TEST_F(SurvivalTest, PipeThatClosesIsNoCrash) {
  RunningProgram fit(folder_, SYSID_FIT, Model() + Arguments{"--out", "fit"});
  fit.ClosePipe();
  EXPECT_EQ(fit.Await(), 128 + SIGPIPE);
  EXPECT_EQ(fit.Errors(), NoReportNote());
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
