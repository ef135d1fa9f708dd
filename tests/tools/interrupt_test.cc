// Ctrl-C and kill: the best point so far is written, and marked; a second one
// ends at once. What is stopped where is tested beside the solvers
// (tests/sysid/diagnosis/interrupted_test.cc); this is the programs' part.

#include <csignal>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>

#include "tests/support/running_program.h"
#include "tests/tools/programs.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::json;

class InterruptTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ProgramFolder;
    SimulateInto(*folder_, "run.csv",
                 {"--model", "pendulum2_planar", "--add",
                  "coulomb_friction@joint1=0.05,viscous_damping@joint2=0.02",
                  "--duration", "20"});
    SimulateInto(*folder_, "other.csv",
                 {"--model", "pendulum2_planar", "--add",
                  "coulomb_friction@joint1=0.05,viscous_damping@joint2=0.02",
                  "--seed", "2", "--duration", "20"});
  }
  static void TearDownTestSuite() { delete folder_; }

  static Arguments Model() {
    return {"--model", "pendulum2_planar", "--traj",
            "run.csv", "--free",           "link1.length=0.4,link2.length=0.4"};
  }
  // Adam with more epochs than anybody waits for.
  static Arguments Endless() {
    return Model() + Arguments{"--solver", "adam", "--epochs", "1000000"};
  }
  // Whether a signal ends a fit that has a point by then: before that there is
  // nothing to keep (while the recordings are checked), or nobody who listens.
  static bool EndsWithAPoint(RunningProgram* fit, int signal) {
    return fit->End(signal) != 128 + signal &&
           fit->Errors().find("before there was a first point") ==
               std::string::npos;
  }
  // A fit once `signals` says that it had begun: a signal before that ends any
  // program, and how much it works before it begins depends on the build.
  static std::unique_ptr<RunningProgram> AfterItBegan(
      const Arguments& arguments,
      const std::function<bool(RunningProgram*)>& signals) {
    std::unique_ptr<RunningProgram> fit;
    for (double cpu_s = 1.5; cpu_s < 60; cpu_s *= 2) {
      fit = std::make_unique<RunningProgram>(*folder_, SYSID_FIT, arguments);
      EXPECT_TRUE(fit->WorksFor(cpu_s));
      if (signals(fit.get())) break;
    }
    return fit;
  }
  static Json Read(const std::string& name) {
    return Json::parse(folder_->Read(name));
  }

  static ProgramFolder* folder_;
};
ProgramFolder* InterruptTest::folder_ = nullptr;

TEST_F(InterruptTest, WritesTheBestPointAndMarksIt) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const auto running = AfterItBegan(
        Endless() + Arguments{"--out", "adam"},
        [&](RunningProgram* fit) { return EndsWithAPoint(fit, signal); });
    RunningProgram& fit = *running;
    EXPECT_EQ(fit.Await(), 1);
    EXPECT_THAT(fit.Rest(), HasSubstr("link1.length"));
    EXPECT_THAT(fit.Errors(),
                testing::StartsWith("interrupted: stops with what there is; "
                                    "once more ends at once\n"));
    EXPECT_THAT(fit.Errors(),
                HasSubstr("\ninterrupted: the best point so far is written\n"
                          "error: no usable result: interrupted after"));
    const Json json = Read("adam/fit.json");
    EXPECT_FALSE(json["converged"].get<bool>());
    EXPECT_THAT(json["termination"].get<std::string>(),
                HasSubstr("interrupted after"));
    EXPECT_GT(json["iterations"].get<int>(), 0);
    EXPECT_LT(json["iterations"].get<int>(), 1000000);
    EXPECT_TRUE(json["parameters"][0]["value"].is_number());
    EXPECT_TRUE(folder_->Has("adam/identified.urdf"));
  }
}

TEST_F(InterruptTest, SaysThatItPrintsWhereNoFileIsNamed) {
  for (const Arguments& json : {Arguments{}, Arguments{"--json", "-"}}) {
    const auto running = AfterItBegan(
        Endless() + json,
        [](RunningProgram* fit) { return EndsWithAPoint(fit, SIGINT); });
    EXPECT_EQ(running->Await(), 1);
    EXPECT_THAT(running->Rest(), HasSubstr("link1.length"));
    EXPECT_THAT(running->Errors(),
                HasSubstr("interrupted: stops with what there is; once more "
                          "ends at once\n"
                          "interrupted: the best point so far is printed\n"));
  }
}

TEST_F(InterruptTest, EndsAtOnceTheSecondTime) {
  // An epoch of half a minute or more: the first signal, which is heard, is not
  // answered before the second comes. That ends the program by itself: once the
  // epoch was over, it would end with exit code 1.
  const auto running =
      AfterItBegan(Model() + Arguments{"--solver", "gmm", "--draws", "10000",
                                       "--threads", "1", "--out", "gmm"},
                   [](RunningProgram* fit) {
                     fit->Signal(SIGINT);
                     return fit->RunsUntil([&] {
                       return fit->Errors().find("once more ends at once") !=
                              std::string::npos;
                     });
                   });
  RunningProgram& fit = *running;
  fit.Signal(SIGINT);
  EXPECT_EQ(fit.Await(), 128 + SIGINT);
  EXPECT_FALSE(folder_->Has("gmm/fit.json"));
}

TEST_F(InterruptTest, IsNoInterruptWhereItIsIgnored) {
  // As a shell starts what it puts into the background.
  RunningProgram fit(
      *folder_, "/bin/sh",
      {"-c", "trap '' INT; echo ready; exec \"$0\" \"$@\"", SYSID_FIT,
       "--model", "pendulum2_planar", "--traj", "run.csv", "--free",
       "link1.length=0.4", "--json", "ignored.json"});
  ASSERT_EQ(fit.Line(), "ready");
  for (double cpu_s = 0.02; fit.WorksFor(cpu_s); cpu_s += 0.02) {
    fit.Signal(SIGINT);
  }
  EXPECT_EQ(fit.Await(), 0);
  EXPECT_TRUE(Read("ignored.json")["converged"].get<bool>());
}

// Whenever it comes: a whole result, an interrupted one, or none.
TEST_F(InterruptTest, LeavesNoDiagnosisThatSaysMoreThanItJudged) {
  const Arguments diagnose =
      Model() + Arguments{"--holdout", "other.csv", "--auto", "--out"};
  int interrupted = 0;
  for (int cpu_ms = 40;; cpu_ms *= 2) {
    const std::string out = "diagnosis" + std::to_string(cpu_ms);
    RunningProgram program(*folder_, SYSID_DIAGNOSE, diagnose + Arguments{out});
    const bool ended = !program.WorksFor(1e-3 * cpu_ms);
    program.Signal(SIGINT);
    const int code = program.Await();
    const std::string errors = program.Errors();
    SCOPED_TRACE(std::to_string(cpu_ms) + " ms: " + errors);
    EXPECT_EQ(errors.find("***"), std::string::npos);
    if (code == 0) {
      EXPECT_TRUE(Read(out + "/diagnosis.json")["interrupted"].is_null());
      if (ended) break;
      continue;  // it came while the result was written
    }
    if (code == 128 + SIGINT) {  // before it began: nothing was at stake
      EXPECT_FALSE(folder_->Has(out + "/diagnosis.json"));
      continue;
    }
    ASSERT_EQ(code, 1);
    EXPECT_THAT(errors, HasSubstr("interrupted"));
    if (!folder_->Has(out + "/diagnosis.json")) {
      EXPECT_THAT(errors, HasSubstr("nothing was fitted"));
      EXPECT_THAT(errors, Not(HasSubstr("is written")));
      continue;
    }
    ++interrupted;
    EXPECT_THAT(errors, HasSubstr("what was judged so far is written\n"));
    EXPECT_THAT(errors, Not(HasSubstr("nothing was fitted")));
    const Json json = Read(out + "/diagnosis.json");
    EXPECT_TRUE(json["interrupted"].is_string());
    EXPECT_THAT(json["sentence"].get<std::string>(),
                HasSubstr("was interrupted while"));
    EXPECT_THAT(json["doubts"].dump(), HasSubstr("interrupted while"));
    EXPECT_TRUE(json["baseline"]["train"]["normalized_rms"].is_number());
    EXPECT_THAT(program.Rest(), HasSubstr("interrupted while"));
  }
  EXPECT_GT(interrupted, 0);
}

TEST_F(InterruptTest, ComparesTheStartsThatAreDone) {
  RunningProgram compare(
      *folder_, SYSID_COMPARE,
      Model() + Arguments{"--epochs", "3", "--draws", "2", "--repeat", "10000",
                          "--json", "comparison.json"});
  ASSERT_TRUE(compare.WorksFor(15.0));
  EXPECT_EQ(compare.End(SIGINT), 1);
  const Json json = Read("comparison.json");
  const size_t done = json["trials"].size();
  EXPECT_GE(done, 1u);
  EXPECT_LT(done, 10000u);
  EXPECT_THAT(compare.Errors(),
              HasSubstr("error: interrupted after " + std::to_string(done) +
                        " of 10000 starts"));
}

}  // namespace
}  // namespace sysid
