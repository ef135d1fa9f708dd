// One fit over many processes: docs/processes.md. SYSID_MPIRUN is mpirun,
// SYSID_COUNT_MPI_BYTES the library of tests/support/count_mpi_bytes.cc.

#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/running_program.h"
#include "tests/tools/programs.h"

namespace sysid {
namespace {

using Json = nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

Arguments MpiRun(int processes) {
  return {"--allow-run-as-root", "--oversubscribe", "-n",
          std::to_string(processes)};
}

// Five runs of a double pendulum; one is larger than all others together.
class ProcessesTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ProgramFolder;
    std::filesystem::create_directories(folder_->Path("runs"));
    int number = 0;
    for (const char* const duration : {"2", "1", "9", "1.5", "2"}) {
      ++number;
      SimulateInto(*folder_, "runs/" + std::to_string(number) + ".csv",
                   {"--model", "pendulum2_planar", "--add",
                    "viscous_damping@joint1=0.02", "--duration", duration,
                    "--seed", std::to_string(number)});
    }
    // With friction that the fitted model does not have.
    for (const char* const name : {"1", "2", "3"}) {
      SimulateInto(
          *folder_, std::string("rubs") + name + ".csv",
          {"--model", "pendulum2_planar", "--add",
           "coulomb_friction@joint1=0.05", "--duration", "3", "--seed", name});
      SimulateInto(*folder_, std::string("driven") + name + ".csv",
                   {"--model", "cartpole", "--excite", "multisine",
                    "--duration", "4", "--seed", name});
    }
  }
  static void TearDownTestSuite() { delete folder_; }
  // Containers may forbid what a launcher needs.
  void SetUp() override {
    const ProgramResult result =
        folder_->Run(SYSID_MPIRUN, MpiRun(2) + Arguments{"true"});
    if (result.exit_code != 0) {
      GTEST_SKIP() << "mpirun starts no program here: " << result.err;
    }
  }

  static Arguments Pendulum() {
    return {"--model",   "pendulum2_planar",
            "--traj",    "runs/?.csv",
            "--free",    "link1.length=0.45,link2.length=0.45,link2.mass=0.8",
            "--check",   "none",
            "--json",    "-",
            "--threads", "1"};
  }
  static ProgramResult RunBy(int processes, const Arguments& arguments) {
    return folder_->Run(SYSID_MPIRUN,
                        MpiRun(processes) + Arguments{SYSID_FIT} + arguments);
  }
  static Json Alone(const Arguments& arguments) {
    const ProgramResult result = folder_->Run(SYSID_FIT, arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(result.out, nullptr, false);
  }
  static Json By(int processes, const Arguments& arguments) {
    const ProgramResult result = RunBy(processes, arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const Json fit = Json::parse(result.out, nullptr, false);
    EXPECT_EQ(fit["processes"], processes) << result.out;
    return fit;
  }

  static ProgramFolder* folder_;
};

ProgramFolder* ProcessesTest::folder_ = nullptr;

// In standard errors, which may differ by this part of them.
double Apart(const Json& fit, const Json& other, double part = 1e-6) {
  double apart = 0.0;
  for (size_t i = 0; i < other["parameters"].size(); ++i) {
    const Json &a = fit["parameters"][i], &b = other["parameters"][i];
    if (b["std_error"].is_null()) continue;
    const double error = b["std_error"].get<double>();
    apart = std::max(
        apart,
        std::abs(a["value"].get<double>() - b["value"].get<double>()) / error);
    EXPECT_NEAR(a["std_error"].get<double>(), error, part * error);
  }
  return apart;
}

void ExpectSame(const Json& fit, const Json& other) {
  EXPECT_LT(Apart(fit, other), 1e-9);
  for (const char* const key :
       {"converged", "iterations", "samples", "not_identifiable", "step_s"}) {
    EXPECT_EQ(fit[key], other[key]) << key;
  }
  const Json &errors = fit["error"], &expected = other["error"];
  EXPECT_NEAR(errors["train"]["normalized_rms"].get<double>(),
              expected["train"]["normalized_rms"].get<double>(), 1e-8);
  ASSERT_EQ(errors["horizon"].size(), expected["horizon"].size());
  for (size_t i = 0; i < expected["horizon"].size(); ++i) {
    const double rms = expected["horizon"][i]["rms"];
    EXPECT_NEAR(errors["horizon"][i]["rms"].get<double>(), rms, 1e-5 * rms);
  }
  ASSERT_EQ(errors["segments"].size(), expected["segments"].size());
  for (size_t i = 0; i < expected["segments"].size(); ++i) {
    EXPECT_EQ(errors["segments"][i]["trajectory"],
              expected["segments"][i]["trajectory"]);
  }
  ASSERT_EQ(errors["open"].size(), expected["open"].size());
  for (size_t i = 0; i < expected["open"].size(); ++i) {
    EXPECT_EQ(errors["open"][i]["trajectory"],
              expected["open"][i]["trajectory"]);
  }
}

TEST_F(ProcessesTest, FindWhatOneFinds) {
  const Json alone = Alone(Pendulum());
  EXPECT_FALSE(alone.contains("processes"));
  for (const int processes : {1, 2, 4, 5, 8}) {
    SCOPED_TRACE(processes);
    ExpectSame(By(processes, Pendulum()), alone);
  }
}

TEST_F(ProcessesTest, PredictHeldOutRunsAlike) {
  Arguments arguments = Pendulum();
  arguments[3] = "runs/[1-3].csv";
  arguments = arguments + Arguments{"--holdout", "runs/[45].csv"};
  const Json alone = Alone(arguments);
  const Json three = By(3, arguments);
  ExpectSame(three, alone);
  EXPECT_NEAR(three["error"]["holdout"]["normalized_rms"].get<double>(),
              alone["error"]["holdout"]["normalized_rms"].get<double>(), 1e-6);
}

TEST_F(ProcessesTest, KnowWhatTheModelMisses) {
  const Arguments arguments = {"--model",   "pendulum2_planar",
                               "--traj",    "rubs?.csv",
                               "--free",    "link1.length,link2.length",
                               "--check",   "none",
                               "--json",    "-",
                               "--threads", "1"};
  const Json alone = Alone(arguments);
  ASSERT_FALSE(alone["discrepancy"].empty());
  for (const int processes : {2, 5}) {
    const Json fit = By(processes, arguments);
    ExpectSame(fit, alone);
    ASSERT_EQ(fit["discrepancy"].size(), alone["discrepancy"].size());
    for (size_t i = 0; i < alone["discrepancy"].size(); ++i) {
      const double force = alone["discrepancy"][i]["force_std"];
      EXPECT_NEAR(fit["discrepancy"][i]["force_std"].get<double>(), force,
                  1e-6 * force);
    }
  }
}

TEST_F(ProcessesTest, CompareEfforts) {
  const Arguments arguments = {
      "--model", "cartpole", "--traj", "driven?.csv", "--free",    "inertial",
      "--check", "none",     "--json", "-",           "--threads", "1"};
  // Of inertial parameters some can hardly be told apart: by other sums than
  // those of Ceres they end elsewhere, by the same sums at the same place.
  const Json alone = Alone(arguments), two = By(2, arguments);
  ExpectSame(two, By(1, arguments));
  EXPECT_LT(Apart(two, alone, 1e-4), 1e-4);
  ASSERT_FALSE(alone["error"]["effort"].empty());
  EXPECT_NEAR(two["error"]["effort"][0]["rms"].get<double>(),
              alone["error"]["effort"][0]["rms"].get<double>(), 1e-9);
  EXPECT_EQ(two["error"]["effort_cut_off_hz"],
            alone["error"]["effort_cut_off_hz"]);
  EXPECT_EQ(two["base_parameters"].size(), alone["base_parameters"].size());
}

TEST_F(ProcessesTest, OnlyTheFirstWritesAndPrints) {
  Arguments arguments = Pendulum();
  arguments[8] = "--out";
  arguments[9] = "result";
  // Of an earlier fit, which would stand beside this one's.
  std::filesystem::create_directory(folder_->Path("result"));
  folder_->Write("result/report.html", "an earlier fit");
  const ProgramResult result = RunBy(3, arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("3 parameters fitted to 5 runs"));
  EXPECT_EQ(result.out.find("fitted to"), result.out.rfind("fitted to"));
  EXPECT_THAT(result.err, HasSubstr("note: --traj: 3 processes share out the "
                                    "runs by size, 1 to 2 each\n"));
  EXPECT_THAT(result.err,
              HasSubstr("note: no prediction.csv and no report.html (those of "
                        "an earlier fit are removed)"));
  EXPECT_FALSE(folder_->Has("result/report.html"));
  EXPECT_TRUE(folder_->Has("result/fit.json"));
  EXPECT_TRUE(folder_->Has("result/identified.urdf"));
  EXPECT_FALSE(folder_->Has("result/checkpoint.cbor"));
}

TEST_F(ProcessesTest, AddEffects) {
  Arguments arguments =
      Pendulum() + Arguments{"--add", "coulomb_friction@joint1"};
  arguments[3] = "rubs?.csv";
  const Json fit = By(2, arguments);
  const Json alone = Alone(arguments);
  EXPECT_TRUE(fit["converged"].get<bool>());
  EXPECT_EQ(fit["parameters"].back()["name"], "joint1.friction");
  EXPECT_NEAR(fit["parameters"].back()["value"].get<double>(), 0.05, 0.002);
  // Begun elsewhere: the same minimum.
  EXPECT_LT(Apart(fit, alone, 1e-2), 1e-2);
}

// Whose the column is, though each process knows one run alone.
TEST_F(ProcessesTest, NameTheRunInWhatTheySuggest) {
  for (const char* const name : {"left.csv", "right.csv"}) {
    SimulateInto(*folder_, name, {"--model", "pendulum2_planar"});
  }
  std::string text = folder_->Read("right.csv");
  text.replace(text.find("joint2.q"), 8, "joint9.q");
  folder_->Write("right.csv", text);
  const ProgramResult result =
      RunBy(2, {"--model", "pendulum2_planar", "--traj", "left.csv,right.csv",
                "--threads", "1"});
  EXPECT_THAT(result.err, HasSubstr("--columns 'right.csv/joint2.q=joint9.q'"));
}

TEST_F(ProcessesTest, EndByBadInputOfAnyOfThem) {
  folder_->Write("bad.csv", "t,joint1.q,joint2.q\n0,1,0\n0.1,x,0\n");
  Arguments arguments = Pendulum();
  arguments[3] = "runs/1.csv,runs/3.csv,bad.csv";
  const ProgramResult result = RunBy(3, arguments);
  EXPECT_EQ(result.exit_code, 2);
  const std::string error =
      "error: bad.csv:3:2: 'x' in column 'joint1.q' is not a number";
  EXPECT_THAT(result.err, HasSubstr(error));
  EXPECT_EQ(result.err.find(error), result.err.rfind(error)) << result.err;
  const Json skipped = By(3, arguments + Arguments{"--skip_bad_runs"});
  EXPECT_EQ(skipped["skipped_runs"][0]["run"], "bad.csv");
}

TEST_F(ProcessesTest, CheckTheRunsOfAll) {
  // Without the rows of a third of a second.
  std::istringstream whole(folder_->Read("runs/5.csv"));
  std::string gap, line;
  for (int row = 0; std::getline(whole, line); ++row) {
    if (row < 50 || row > 82) gap += line + "\n";
  }
  folder_->Write("gap.csv", gap);
  Arguments arguments = Pendulum();
  arguments[3] = "runs/3.csv,gap.csv";
  arguments[7] = "numbers";
  const Json alone = Alone(arguments);
  ASSERT_FALSE(alone["findings"].empty());
  EXPECT_EQ(By(2, arguments)["findings"], alone["findings"]);
}

TEST_F(ProcessesTest, RefuseWhatOneAloneDoes) {
  const auto refused = [](const Arguments& more, const std::string& says,
                          const std::string& hint) {
    Arguments arguments = Pendulum();
    arguments.erase(arguments.begin() + 6, arguments.begin() + 8);  // --check
    const ProgramResult result = RunBy(2, arguments + more);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("error: " + says));
    EXPECT_THAT(result.err, HasSubstr("hint: " + hint));
  };
  refused({"--check", "all"},
          "--check: hypotheses about the data are tested by one process alone",
          "--check numbers here, and sysid_check on some of the runs");
  refused({"--add", "cogging@joint1"},
          "--add: joint1.cogging_order of cogging@joint1 is found by one "
          "process alone",
          "give it: --fix joint1.cogging_order=N");
  refused({"--solver", "inverse_dynamics"},
          "--solver: inverse_dynamics fits by one process alone",
          "--solver lm fits by many");
  refused({"--resume"}, "--resume: has no folder to go on in",
          "name that of the fit which was ended: --out DIR");
}

// Bytes that a process exchanged in reductions, the most of two.
double BytesExchanged(const ProgramFolder& folder, const Arguments& arguments) {
  const std::string counts = folder.Path("bytes");
  const ProgramResult result =
      folder.Run(SYSID_MPIRUN,
                 MpiRun(2) +
                     Arguments{"-x", "LD_PRELOAD=" SYSID_COUNT_MPI_BYTES, "-x",
                               "COUNT_MPI_BYTES=" + counts, SYSID_FIT} +
                     arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  double most = 0.0;
  for (const char* const rank : {".0", ".1"}) {
    double reduced = 0.0;
    std::ifstream(counts + rank) >> reduced;
    EXPECT_GT(reduced, 0.0);
    most = std::max(most, reduced);
  }
  return most;
}

TEST_F(ProcessesTest, ExchangeAsMuchWhateverTheRuns) {
  for (const auto& [name, duration] :
       {std::pair("short", "2"), std::pair("long", "8")}) {
    for (int i = 1; i <= 8; ++i) {
      SimulateInto(*folder_, name + std::to_string(i) + ".csv",
                   {"--model", "pendulum2_planar", "--duration", duration,
                    "--seed", std::to_string(i)});
    }
  }
  Arguments arguments = Pendulum();
  arguments[3] = "short[1-2].csv";
  const double few = BytesExchanged(*folder_, arguments);
  arguments[3] = "short?.csv";
  const double more_runs = BytesExchanged(*folder_, arguments);
  arguments[3] = "long[1-2].csv";
  const double more_samples = BytesExchanged(*folder_, arguments);
  RecordProperty("few", std::to_string(few));
  RecordProperty("more_runs", std::to_string(more_runs));
  RecordProperty("more_samples", std::to_string(more_samples));
  EXPECT_LT(few, 61440.0);  // a linearisation is some kB
  EXPECT_LT(more_runs, 1.5 * few);
  EXPECT_LT(more_samples, 1.5 * few);
}

// A fit that takes some seconds; each process that the launcher starts leaves
// its number in a file.
class LongFitTest : public ProcessesTest {
 protected:
  LongFitTest() {
    for (int i = 1; i <= 4; ++i) {
      SimulateInto(*folder_, "all" + std::to_string(i) + ".csv",
                   {"--model", "pendulum3_planar", "--duration", "20", "--seed",
                    std::to_string(i)});
    }
  }
  static Arguments Fit(const std::string& out) {
    return {"--model",   "pendulum3_planar",
            "--traj",    "all?.csv",
            "--free",    "link1.length=0.4,link2.length=0.6,link3.length=0.4",
            "--check",   "none",
            "--out",     out,
            "--threads", "1"};
  }
  static Arguments Command(int processes, const Arguments& arguments) {
    return MpiRun(processes) +
           Arguments{"sh", "-c",
                     "echo $$ > pid.$OMPI_COMM_WORLD_RANK; exec \"$0\" \"$@\"",
                     SYSID_FIT} +
           arguments;
  }
  // The process of a rank that the launcher knows, once so many stages have
  // ended.
  static pid_t WaitFor(RunningProgram* job, const std::string& out,
                       size_t stages, int rank) {
    const std::string file = out + "/checkpoint.cbor";
    job->RunsUntil([&] {
      if (!folder_->Has(file)) return false;
      const Json kept = Json::from_cbor(folder_->Read(file), true, false);
      return kept.is_object() && kept["stages"].size() >= stages;
    });
    return std::stoi(folder_->Read("pid." + std::to_string(rank)));
  }
  // Its child, which does the work.
  static pid_t WorkerOf(pid_t process) {
    const std::string number = std::to_string(process);
    std::ifstream children("/proc/" + number + "/task/" + number + "/children");
    pid_t child = 0;
    children >> child;
    return child;
  }
  static Json Read(const std::string& out) {
    return Json::parse(folder_->Read(out + "/fit.json"), nullptr, false);
  }
};

TEST_F(LongFitTest, AKilledProcessEndsTheJobWhichGoesOnFromItsStage) {
  RunningProgram job(*folder_, SYSID_MPIRUN, Command(2, Fit("killed")));
  const pid_t worker = WorkerOf(WaitFor(&job, "killed", 1, 1));
  ASSERT_GT(worker, 1);
  kill(worker, SIGKILL);
  EXPECT_EQ(job.Await(), 1);
  EXPECT_THAT(job.Errors(),
              HasSubstr("error: process 1 was killed by signal 9"));
  EXPECT_FALSE(folder_->Has("killed/fit.json"));
  const ProgramResult resumed = RunBy(3, Fit("killed") + Arguments{"--resume"});
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("note: goes on after "));
  EXPECT_FALSE(folder_->Has("killed/checkpoint.cbor"));
  const ProgramResult whole = folder_->Run(SYSID_FIT, Fit("whole"));
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_LT(Apart(Read("killed"), Read("whole")), 1e-9);
  EXPECT_EQ(Read("killed")["iterations"], Read("whole")["iterations"]);
}

// Of a fit that goes on: its best point, or where there is none yet, where to
// go on from.
TEST_F(LongFitTest, AnInterruptOfAResumedFitLosesNothing) {
  RunningProgram first(*folder_, SYSID_FIT, Fit("early"));
  first.RunsUntil([] { return folder_->Has("early/checkpoint.cbor"); });
  first.End(SIGKILL);
  ASSERT_TRUE(folder_->Has("early/checkpoint.cbor"));
  RunningProgram resumed(*folder_, SYSID_FIT,
                         Fit("early") + Arguments{"--resume"});
  resumed.RunsUntil([&] {
    return resumed.Errors().find("note: goes on after ") != std::string::npos;
  });
  EXPECT_EQ(resumed.End(SIGTERM), 1) << resumed.Errors();
  EXPECT_TRUE(folder_->Has("early/checkpoint.cbor"));
  if (!folder_->Has("early/fit.json")) {
    EXPECT_THAT(
        resumed.Errors(),
        HasSubstr("note: the stages that ended are in "
                  "early/checkpoint.cbor: --resume goes on from there"));
  }
}

TEST_F(LongFitTest, AnInterruptOfAnyProcessKeepsTheBestPoint) {
  RunningProgram job(*folder_, SYSID_MPIRUN, Command(2, Fit("stopped")));
  kill(WaitFor(&job, "stopped", 3, 1), SIGTERM);
  EXPECT_EQ(job.Await(), 1) << job.Errors();
  const Json fit = Read("stopped");
  EXPECT_FALSE(fit["converged"].get<bool>());
  EXPECT_THAT(fit["termination"].get<std::string>(), HasSubstr("interrupted"));
  EXPECT_TRUE(folder_->Has("stopped/checkpoint.cbor"));
}

}  // namespace
}  // namespace sysid
