#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/tools/programs.h"

namespace sysid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string kRuns = std::string(SYSID_SOURCE) + "/data/runs/";

// The first 3 s of the shipped run of the cart and pole with one column
// changed: under the sanitizers the whole of it takes minutes.
std::string Changed(const std::string& column,
                    const std::function<double(double t, double)>& change) {
  std::ifstream in(kRuns + "cartpole.csv");
  std::string line, out;
  int at = -1;
  constexpr int kRows = 300;
  for (int rows = -1; rows < kRows && std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    ++rows;
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    if (at < 0) {
      for (size_t i = 0; i < cells.size(); ++i) {
        if (cells[i] == column) at = static_cast<int>(i);
      }
    } else {
      cells[at] =
          std::to_string(change(std::stod(cells[0]), std::stod(cells[at])));
    }
    for (size_t i = 0; i < cells.size(); ++i) out += (i ? "," : "") + cells[i];
    out += "\n";
  }
  return out;
}

TEST(CheckTest, HelpShowsAnExampleThatRuns) {
  ExpectHelp(ProgramFolder(), SYSID_CHECK, "sysid_check");
}

TEST(CheckTest, TheSolverOfAFitMayBeGiven) {
  const ProgramFolder folder;
  const ProgramResult result = folder.Run(
      SYSID_CHECK, {"--model", "cartpole", "--traj", kRuns + "cartpole.csv",
                    "--solver", "inverse_dynamics"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST(CheckTest, AnEffectMayReadNothingThatIsNotThere) {
  const ProgramFolder folder;
  const ProgramResult result = folder.Run(
      SYSID_CHECK, {"--model", "cartpole", "--traj", kRuns + "cartpole.csv",
                    "--add", "position_drive@slider"});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, HasSubstr("position_drive@slider reads slider.cmd"));
}

TEST(CheckTest, NothingIsFoundInAShippedRun) {
  const ProgramFolder folder;
  const ProgramResult result =
      folder.Run(SYSID_CHECK, {"--model", "cartpole", "--traj",
                               kRuns + "cartpole.csv", "--out", "out"});
  EXPECT_EQ(result.exit_code, 0) << result.out;
  EXPECT_EQ(result.out, "cartpole: nothing wrong with 1 run\n");
  const auto json = nlohmann::json::parse(folder.Read("out/check.json"));
  EXPECT_EQ(json["schema"], "sysid.check/1");
  EXPECT_TRUE(json["findings"].empty());
  EXPECT_LT(json["error"].get<double>(), 1.5);
}

// No fault of the data; but "nothing wrong" alone would not be all of it.
TEST(CheckTest, AMissingEffectIsNoFindingButIsSaid) {
  const ProgramFolder folder;
  const ProgramResult made = folder.Run(
      SYSID_SIMULATE,
      {"--model", "cartpole", "--add", "spring@hinge=1.5", "--duration", "3",
       "--excite", "multisine", "--seed", "3", "--out_csv", "run.csv"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const ProgramResult result =
      folder.Run(SYSID_CHECK,
                 {"--model", "cartpole", "--traj", "run.csv", "--out", "out"});
  EXPECT_EQ(result.exit_code, 0) << result.out;
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("cartpole: nothing wrong with 1 run was found, "
                              "but the error of the model is "),
                    HasSubstr("sysid_diagnose looks for missing effects\n")));
  const auto json = nlohmann::json::parse(folder.Read("out/check.json"));
  EXPECT_GT(json["error"].get<double>(), 1.5);
}

TEST(CheckTest, AFlippedAxisIsNamedWithItsFlagAndExitCodeOne) {
  const ProgramFolder folder;
  folder.Write("a.csv",
               Changed("hinge.q", [](double, double q) { return -q; }));
  const Arguments flags = {"--model", "cartpole", "--traj", "a.csv"};
  const ProgramResult result =
      folder.Run(SYSID_CHECK, flags + Arguments{"--json", "-"});
  EXPECT_EQ(result.exit_code, 1);
  const auto json = nlohmann::json::parse(result.out);
  ASSERT_EQ(json["findings"].size(), 1u) << result.out;
  const auto& first = json["findings"][0];
  EXPECT_EQ(first["fault"], "axis_flipped");
  EXPECT_EQ(first["subject"], "hinge.q");
  EXPECT_EQ(first["remedies"][0], "--columns hinge.q=-hinge.q");
  EXPECT_EQ(
      folder
          .Run(SYSID_CHECK, flags + Arguments{"--columns", "hinge.q=-hinge.q"})
          .exit_code,
      0);
}

// One value of the hinge jumps away at 1.5 s.
std::string WithSpike() {
  return Changed("hinge.q", [](double t, double q) {
    return std::abs(t - 1.5) < 1e-6 ? q + 40.0 : q;
  });
}

TEST(CheckTest, AFitSaysWhatTheCheckFound) {
  const ProgramFolder folder;
  folder.Write("a.csv", WithSpike());
  const ProgramResult fit = folder.Run(
      SYSID_FIT,
      {"--model", "cartpole", "--traj", "a.csv", "--json", "fit.json"});
  EXPECT_THAT(fit.err, HasSubstr("note: spikes: a.csv: hinge.q, 1.5 s"));
  EXPECT_THAT(fit.out,
              HasSubstr("  checked: 1 finding in 1 run, first spikes\n"));
  const auto fitted = nlohmann::json::parse(folder.Read("fit.json"));
  EXPECT_EQ(fitted["findings"][0]["fault"], "spikes");
}

TEST(CheckTest, SpikesAreIgnoredByTheFlagThatIsNamed) {
  const ProgramFolder folder;
  folder.Write("a.csv", WithSpike());
  const Arguments flags = {"--model", "cartpole", "--traj", "a.csv"};
  const ProgramResult result =
      folder.Run(SYSID_CHECK, flags + Arguments{"--json", "-"});
  EXPECT_EQ(result.exit_code, 1);
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["findings"][0]["fault"], "spikes");
  const std::string remedy = json["findings"][0]["remedies"][0];
  ASSERT_EQ(remedy, "--ignore hinge.q@1.495:1.505");
  EXPECT_EQ(
      folder.Run(SYSID_CHECK, flags + Arguments{"--ignore", remedy.substr(9)})
          .exit_code,
      0);
}

// What is given for a run by its name is mended under that name.
TEST(CheckTest, AColumnThatIsGivenForOneRunIsMendedThere) {
  const ProgramFolder folder;
  folder.Write("a.csv", Changed("hinge.q", [](double, double q) { return q; }));
  const auto check = [&](const std::string& columns) {
    return folder.Run(SYSID_CHECK, {"--model", "cartpole", "--traj", "a.csv",
                                    "--columns", columns});
  };
  EXPECT_THAT(check("a.csv/hinge.q=-hinge.q").out,
              HasSubstr("suggested fix: --columns 'a.csv/hinge.q=hinge.q'\n"));
}

TEST(CheckTest, WhatTheReaderRefusesIsAFindingAndTheOtherRunsAreChecked) {
  const ProgramFolder folder;
  folder.Write("a.csv", "t,slider.q,hinge.q\n0,0,0\n1,0,1\n1,0,2\n");
  const ProgramResult result = folder.Run(
      SYSID_CHECK,
      {"--model", "cartpole", "--traj", "a.csv," + kRuns + "cartpole.csv"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("1. time_repeats  a.csv:4:1\n"));
  EXPECT_THAT(result.out, HasSubstr("cartpole: 1 finding in 2 runs"));
}

TEST(CheckTest, WhatIsRefusedOfOneRunIsMendedInThatRunAlone) {
  const ProgramFolder folder;
  folder.Write("a.csv", Changed("t", [](double, double t) { return 1e3 * t; }));
  const std::vector<std::string> both = {"--model", "cartpole", "--traj",
                                         "a.csv," + kRuns + "cartpole.csv"};
  const ProgramResult result = folder.Run(SYSID_CHECK, both);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, AllOf(HasSubstr("1. milliseconds  a.csv\n"),
                                HasSubstr("suggested fix: --columns "
                                          "'a.csv/t=t*0.001'\n")));
  std::vector<std::string> mended = both;
  mended.insert(mended.end(), {"--columns", "a.csv/t=t*0.001"});
  EXPECT_EQ(folder.Run(SYSID_CHECK, mended).exit_code, 0);
  // All of them alike: one flag for all.
  const ProgramResult alone =
      folder.Run(SYSID_CHECK, {"--model", "cartpole", "--traj", "a.csv"});
  EXPECT_THAT(alone.out, HasSubstr("suggested fix: --columns t=t*0.001  (if"));
}

TEST(CheckTest, NothingOfAFileIsACommandToTheTerminal) {
  const ProgramFolder folder;
  folder.Write("a.csv",
               "t,slider.q,hinge.q,\x1b[2J\u009b2J\n0,0,0,1\n1,0,1,1\n");
  const ProgramResult result =
      folder.Run(SYSID_CHECK, {"--model", "cartpole", "--traj", "a.csv"});
  EXPECT_THAT(result.err, HasSubstr("; ignored the column ?[2J?2J: --columns"));
}

TEST(CheckTest, BadUsageIsRefused) {
  const ProgramFolder folder;
  ExpectRefused(folder, SYSID_CHECK,
                {"--model", "cartpole", "--traj", "none.csv"}, "none.csv", "",
                "");
  ExpectRefused(folder, SYSID_CHECK,
                {"--model", "cartpole", "--traj", kRuns + "cartpole.csv",
                 "--shift", "hinge=x"},
                "--shift", "'x' is not a number of seconds", "joint1.q=0.010");
  // What is found only beside a file is the flag's fault all the same.
  ExpectRefused(folder, SYSID_CHECK,
                {"--model", "cartpole", "--traj", kRuns + "cartpole.csv",
                 "--columns", "hinge.q=hinge.q*5+((hinge.q)"},
                "--columns", "not closed", "write column*number");
  ExpectRefused(folder, SYSID_CHECK,
                {"--model", "cartpole", "--traj", kRuns + "cartpole.csv",
                 "--shift", "hinge.q=1e9"},
                "--shift", "leaves little of", "it is in seconds");
}

}  // namespace
}  // namespace sysid
