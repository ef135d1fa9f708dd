// The programs killed at a hundred random moments: every file is whole or
// absent, and what was there before is not lost (docs/robustness.md).

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <random>
#include <thread>

#include "tests/support/running_program.h"
#include "tests/tools/survival.h"

namespace sysid {
namespace {

namespace fs = std::filesystem;

long Lines(const std::string& text) {
  return std::count(text.begin(), text.end(), '\n');
}

class KilledTest : public SurvivalTest {
 protected:
  // Kills the program at `times` moments of its life, which the first, whole
  // run measures in processor time: half of them in its last tenth, where it
  // writes.
  void KillAtRandom(const std::string& program, const Arguments& arguments,
                    int times) {
    const ProgramResult whole = folder_.Run(program, arguments);
    // 1: so few epochs reach nothing, which is of no interest here.
    ASSERT_LE(whole.exit_code, 1) << whole.err;
    const Files before = folder_.Contents();
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    for (int i = 0; i < times; ++i) {
      const double part =
          i % 2 == 0 ? uniform(random) : 0.9 + 0.15 * uniform(random);
      RunningProgram running(folder_, program, arguments);
      running.WorksFor(part * whole.cpu_s);
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
      if (name.ends_with("/checkpoint.cbor")) continue;  // until the result
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
};

TEST_F(KilledTest, KilledFitLeavesWholeFiles) {
  KillAtRandom(SYSID_FIT, Model() + Arguments{"--out", "fit"}, 30);
}

// At fifty moments one after the other, each time further: the answer is that
// of a fit that nobody killed, to the last bit, and so are its iterations.
TEST_F(KilledTest, ResumedFitEndsWhereItWouldHave) {
  const auto fit = [&](const std::string& out) {
    return Model() + Arguments{"--out", out, "--resume"};
  };
  const ProgramResult alone = folder_.Run(SYSID_FIT, fit("whole"));
  ASSERT_EQ(alone.exit_code, 0) << alone.err;
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> part(0.0, 1.2);
  const std::string kept = folder_.Path("killed/checkpoint.cbor");
  int resumed = 0;
  for (int i = 0; i < 50; ++i) {
    RunningProgram running(folder_, SYSID_FIT, fit("killed"));
    // Every other time as soon as there is a checkpoint, or after a tenth of a
    // whole run where there was one before.
    if (i % 2 == 1) {
      running.RunsUntil([&] { return fs::exists(kept); });
      running.WorksFor(0.1 * part(random) * alone.cpu_s);
    } else {
      running.WorksFor(part(random) * alone.cpu_s);
    }
    running.End(SIGKILL);
    if (fs::exists(kept)) ++resumed;
  }
  EXPECT_GT(resumed, 5);
  const ProgramResult last = folder_.Run(SYSID_FIT, fit("killed"));
  ASSERT_EQ(last.exit_code, 0) << last.err;
  Files files = folder_.Contents();
  EXPECT_FALSE(files.contains("killed/checkpoint.cbor"));
  const auto whole = nlohmann::json::parse(files["whole/fit.json"]);
  const auto killed = nlohmann::json::parse(files["killed/fit.json"]);
  EXPECT_EQ(killed["parameters"], whole["parameters"]);
  EXPECT_EQ(killed["iterations"], whole["iterations"]);
  EXPECT_EQ(killed["error"], whole["error"]);
  EXPECT_EQ(files["killed/prediction.csv"], files["whole/prediction.csv"]);
}

TEST_F(KilledTest, ResumeRefusesWhatIsNotThisFits) {
  const Arguments fit = Model() + Arguments{"--out", "fit", "--resume"};
  fs::create_directories(folder_.Path("fit"));
  folder_.Write("fit/checkpoint.cbor", "no CBOR");
  ExpectRefused(folder_, SYSID_FIT, fit, "fit/checkpoint.cbor",
                "is no checkpoint of sysid_fit, or damaged",
                "remove it, or leave --resume out");
  fs::remove(folder_.Path("fit/checkpoint.cbor"));
  fs::create_directory(folder_.Path("fit/checkpoint.cbor"));
  ExpectRefused(folder_, SYSID_FIT, fit, "fit/checkpoint.cbor",
                "is no checkpoint of sysid_fit, or damaged",
                "remove it, or leave --resume out");
  fs::remove(folder_.Path("fit/checkpoint.cbor"));
  const std::vector<std::uint8_t> other = nlohmann::json::to_cbor(
      {{"sysid", "0"}, {"problem", 1}, {"stages", nlohmann::json::array()}});
  folder_.Write("fit/checkpoint.cbor", std::string(other.begin(), other.end()));
  ExpectRefused(folder_, SYSID_FIT, fit, "fit/checkpoint.cbor",
                "is the checkpoint of another fit",
                "remove it, or leave --resume out");
  ExpectRefused(folder_, SYSID_FIT, Model() + Arguments{"--resume"}, "--resume",
                "has no folder to go on in", "--out DIR");
  ExpectRefused(folder_, SYSID_FIT, fit + Arguments{"--solver", "adam"},
                "--resume", "adam keeps no checkpoints",
                "fits by lm keep them");
}

TEST_F(KilledTest, KilledDiagnosisLeavesWholeFiles) {
  KillAtRandom(SYSID_DIAGNOSE,
               Model() + Arguments{"--candidates", "coulomb_friction", "--auto",
                                   "--out", "diagnosis"},
               20);
}

TEST_F(KilledTest, KilledSimulationLeavesAWholeRun) {
  KillAtRandom(SYSID_SIMULATE,
               {"--model", "pendulum2_planar", "--duration", "60", "--rate",
                "1000", "--out_csv", "simulated.csv"},
               20);
}

#ifdef SYSID_HAVE_STAN
TEST_F(KilledTest, KilledComparisonLeavesWholeFiles) {
  Arguments model = Model();
  model.erase(model.begin() + 4, model.begin() + 6);  // no --holdout
  KillAtRandom(SYSID_COMPARE,
               model + Arguments{"--epochs", "60", "--out", "comparison"}, 15);
}
#endif

#ifdef SYSID_STUDIO
// It ends only by a signal, and waits for nothing to do once its fit is done:
// the moments are of the clock, and nothing is expected of any of them. The
// next one continues what was saved.
TEST_F(KilledTest, KilledStudioLeavesASessionThatContinues) {
  const Arguments arguments =
      Model() + Arguments{"--candidates", "coulomb_friction", "--port", "0",
                          "--out",        "session"};
  std::mt19937_64 random(7);
  std::uniform_int_distribution<int> moment_ms(0, 3000);
  for (int i = 0; i < 15; ++i) {
    RunningProgram studio(folder_, SYSID_STUDIO, arguments);
    std::this_thread::sleep_for(std::chrono::milliseconds(moment_ms(random)));
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

}  // namespace
}  // namespace sysid
