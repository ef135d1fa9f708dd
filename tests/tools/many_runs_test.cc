// Runs named by patterns and lists, and bad runs that are set aside.

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/tools/programs.h"

namespace sysid {
namespace {

using Json = nlohmann::json;
using ::testing::HasSubstr;

// Three good runs in fleet/, and a list of them.
class ManyRunsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ProgramFolder;
    std::filesystem::create_directories(folder_->Path("fleet"));
    for (const char* const name : {"1", "2", "3"}) {
      SimulateInto(*folder_, std::string("fleet/") + name + ".csv",
                   {"--model", "pendulum2_planar", "--duration", "2", "--rate",
                    "50", "--seed", name});
    }
  }
  static void TearDownTestSuite() { delete folder_; }

  static Arguments With(const Arguments& more) {
    return Arguments{"--model", "pendulum2_planar",
                     "--free",  "link1.length",
                     "--check", "none",
                     "--json",  "-"} +
           more;
  }
  static Json Fit(const Arguments& more) {
    const ProgramResult result = folder_->Run(SYSID_FIT, With(more));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(result.out, nullptr, false);
  }
  static double Length(const Json& fit) {
    return fit["parameters"][0]["value"].get<double>();
  }

  static ProgramFolder* folder_;
};

ProgramFolder* ManyRunsTest::folder_ = nullptr;

TEST_F(ManyRunsTest, APatternAndAListAreTheRunsWrittenOut) {
  const Json written = Fit({"--traj", "fleet/1.csv,fleet/2.csv,fleet/3.csv"});
  const Json pattern = Fit({"--traj", "fleet/?.csv"});
  folder_->Write("fleet/runs.txt", "# all\n1.csv\n[23].csv\n");
  const Json list = Fit({"--traj", "@fleet/runs.txt"});
  EXPECT_EQ(pattern["samples"], 303);
  EXPECT_EQ(pattern["skipped_runs"], Json::array());
  EXPECT_EQ(Length(pattern), Length(written));
  EXPECT_EQ(Length(list), Length(written));
  EXPECT_EQ(list["error"]["segments"], written["error"]["segments"]);
}

TEST_F(ManyRunsTest, TheHeldOutRunsAreNamedAlike) {
  const Json fit =
      Fit({"--traj", "fleet/[12].csv", "--holdout", "fleet/[3-9].csv"});
  EXPECT_EQ(fit["samples"], 202);
  EXPECT_GT(fit["error"]["holdout"]["normalized_rms"], 0.5);
  ExpectRefused(*folder_, SYSID_FIT,
                With({"--traj", "fleet/?.csv", "--holdout", "fleet/3.csv"}),
                "--holdout", "'fleet/3.csv' is fitted too, or given twice",
                "hold out recordings that are not in --traj");
  ExpectRefused(*folder_, SYSID_FIT,
                With({"--traj", "fleet/1.csv,fleet/?.csv"}), "--traj",
                "'fleet/1.csv' is given twice", "give each recording once");
}

TEST_F(ManyRunsTest, EveryProgramRefusesAPatternWithoutAMatch) {
  for (const char* const program :
       {SYSID_FIT, SYSID_DIAGNOSE, SYSID_CHECK, SYSID_COMPARE}) {
    ExpectRefused(*folder_, program,
                  {"--model", "pendulum2_planar", "--traj", "fleets/*.csv"},
                  "--traj", "no file matches 'fleets/*.csv'",
                  "patterns are * ? [..] as in a shell");
  }
}

// What may be wrong with one run, each with its reason.
class BadRunOfManyTest : public ManyRunsTest {
 protected:
  void SetUp() override {
    folder_->Write("bad.csv", "t,joint1.q,joint2.q\n0,1,0\n0.1,x,0\n");
    folder_->Write("columns.csv", "t,a\n0,1\n0.1,2\n");
    folder_->Write("short.csv",
                   "t,joint1.q,joint2.q\n0,1,0\n0.1,2,0\n0.2,2.5,0\n");
  }
};

TEST_F(BadRunOfManyTest, EndsTheFitWithoutTheFlag) {
  ExpectRefused(*folder_, SYSID_FIT, With({"--traj", "fleet/1.csv,bad.csv"}),
                "bad.csv:3:2", "'x' in column 'joint1.q' is not a number",
                "leave the cell");
}

TEST_F(BadRunOfManyTest, IsSetAsideByNameWithTheFlag) {
  const ProgramResult result = folder_->Run(
      SYSID_FIT,
      With({"--traj",
            "fleet/1.csv,bad.csv,columns.csv,none.csv,short.csv,fleet/2.csv",
            "--skip_bad_runs"}));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(
      result.err,
      HasSubstr(
          "note: --skip_bad_runs: set aside 4 of 6 runs: bad.csv:3:2: "
          "'x' in column 'joint1.q' is not a number; columns.csv:1:1: no "
          "column measures anything of pendulum2_planar; none.csv: there is no "
          "such file; short.csv: has 3 samples: too few to fit "
          "anything\n"));
  const Json fit = Json::parse(result.out);
  const Json skipped = {
      {{"run", "bad.csv"},
       {"reason", "bad.csv:3:2: 'x' in column 'joint1.q' is not a number"}},
      {{"run", "columns.csv"},
       {"reason",
        "columns.csv:1:1: no column measures anything of pendulum2_planar"}},
      {{"run", "none.csv"}, {"reason", "none.csv: there is no such file"}},
      {{"run", "short.csv"},
       {"reason", "short.csv: has 3 samples: too few to fit anything"}}};
  EXPECT_EQ(fit["skipped_runs"], skipped);
  EXPECT_EQ(fit["samples"], 202);
  EXPECT_EQ(Length(fit), Length(Fit({"--traj", "fleet/[12].csv"})));
}

TEST_F(BadRunOfManyTest, IsSetAsideWhereAnEffectReadsWhatItLacks) {
  std::istringstream run(folder_->Read("fleet/1.csv"));
  std::string driven;
  for (std::string line; std::getline(run, line);) {
    const bool is_header = line.starts_with("t,");
    if (!line.starts_with("#")) {
      driven += line + (is_header ? ",joint1.cmd\n" : ",0\n");
    }
  }
  folder_->Write("driven.csv", driven);
  const Json fit = Fit({"--traj", "driven.csv,fleet/2.csv", "--add",
                        "position_drive@joint1", "--skip_bad_runs"});
  const Json skipped = {
      {{"run", "fleet/2.csv"},
       {"reason",
        "fleet/2.csv: position_drive@joint1 reads joint1.cmd, which is not "
        "there"}}};
  EXPECT_EQ(fit["skipped_runs"], skipped);
}

TEST_F(BadRunOfManyTest, IsSetAsideWhereItLacksAMappedColumn) {
  folder_->Write("other.csv", "t,pos\n0,1\n0.1,x\n");
  const ProgramResult result = folder_->Run(
      SYSID_FIT, With({"--traj", "fleet/1.csv,other.csv", "--columns",
                       "joint1.q=joint1.q", "--skip_bad_runs"}));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err,
              HasSubstr("set aside 1 of 2 runs: other.csv: --columns: "
                        "other.csv has no column 'joint1.q'"));
}

TEST_F(BadRunOfManyTest, IsAnErrorWhereNoneIsLeft) {
  ExpectRefused(*folder_, SYSID_FIT,
                With({"--traj", "bad.csv,none.csv", "--skip_bad_runs"}),
                "--traj",
                "no run is left: each of 2 runs is bad: bad.csv:3:2: 'x' in "
                "column 'joint1.q' is not a number; none.csv: there is no such "
                "file",
                "leave the cell");
  ExpectRefused(*folder_, SYSID_FIT,
                With({"--traj", "fleet/1.csv", "--holdout", "bad.csv",
                      "--skip_bad_runs"}),
                "--holdout", "no run is left: each of 1 run is bad",
                "leave the cell");
}

TEST_F(BadRunOfManyTest, IsInTheNextCommandAndTheDiagnosis) {
  const ProgramResult result = folder_->Run(
      SYSID_DIAGNOSE, With({"--traj", "fleet/?.csv,bad.csv", "--candidates",
                            "viscous_damping", "--skip_bad_runs"}));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json diagnosis = Json::parse(result.out);
  EXPECT_EQ(diagnosis["skipped_runs"].size(), 1u);
  EXPECT_EQ(diagnosis["skipped_runs"][0]["run"], "bad.csv");
  EXPECT_THAT(
      diagnosis["next_command"].get<std::string>(),
      HasSubstr(
          "--traj 'fleet/?.csv,bad.csv' --free link1.length --skip_bad_runs"));
}

TEST_F(BadRunOfManyTest, IsAFindingOfTheCheckInAnyCase) {
  const Arguments runs{"--model", "pendulum2_planar",
                       "--traj",  "fleet/1.csv,bad.csv,none.csv",
                       "--json",  "-"};
  ExpectRefused(*folder_, SYSID_CHECK, runs, "none.csv",
                "there is no such file", "check the name");
  const ProgramResult result =
      folder_->Run(SYSID_CHECK, runs + Arguments{"--skip_bad_runs"});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  const Json check = Json::parse(result.out);
  ASSERT_GE(check["findings"].size(), 2u);
  EXPECT_EQ(check["findings"][0]["severity"], "unreadable");
  EXPECT_THAT(check["findings"][0]["file"], HasSubstr("bad.csv"));
  EXPECT_THAT(check["findings"][1]["file"], HasSubstr("none.csv"));
}

}  // namespace
}  // namespace sysid
