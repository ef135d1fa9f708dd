// A search and a comparison over many processes: docs/processes.md.
// SYSID_MPIRUN is mpirun.

#include <nlohmann/json.hpp>

#include "tests/tools/programs.h"

namespace sysid {
namespace {

using Json = nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class SearchProcessesTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ProgramFolder;
    for (const char* const name : {"1", "2"}) {
      SimulateInto(*folder_, std::string("rubs") + name + ".csv",
                   {"--model", "pendulum2_planar", "--add",
                    "coulomb_friction@joint1=0.05,viscous_damping@joint2=0.02",
                    "--duration", "4", "--seed", name});
    }
  }
  static void TearDownTestSuite() { delete folder_; }
  // Containers may forbid what a launcher needs.
  void SetUp() override {
    const ProgramResult result = By(2, "true", {});
    if (result.exit_code != 0) {
      GTEST_SKIP() << "mpirun starts no program here: " << result.err;
    }
  }
  static ProgramResult By(int processes, const std::string& program,
                          const Arguments& arguments) {
    return folder_->Run(
        SYSID_MPIRUN, Arguments{"--allow-run-as-root", "--oversubscribe", "-n",
                                std::to_string(processes), program} +
                          arguments);
  }

  static ProgramFolder* folder_;
};

ProgramFolder* SearchProcessesTest::folder_ = nullptr;

// Of a document, without the times in it.
Json WithoutTimes(Json json) {
  if (json.is_object()) {
    for (const char* const key : {"wall_time_s", "cpu_time_s", "time_s"}) {
      json.erase(key);
    }
  }
  if (json.is_structured()) {
    for (Json& part : json) part = WithoutTimes(std::move(part));
  }
  return json;
}

TEST_F(SearchProcessesTest, OfADiagnosisFindsWhatOneProcessFinds) {
  const Arguments arguments = {
      "--model",   "pendulum2_planar", "--traj",     "rubs1.csv", "--holdout",
      "rubs2.csv", "--free",           "link1.mass", "--auto",    "--threads",
      "1",         "--json",           "-"};
  const ProgramResult alone = folder_->Run(SYSID_DIAGNOSE, arguments);
  ASSERT_EQ(alone.exit_code, 0) << alone.err;
  const Json expected = WithoutTimes(Json::parse(alone.out));
  EXPECT_EQ(expected["verdict"], "missing_effect");
  EXPECT_EQ(expected["final_fit"]["effects"].size(), 2u);
  for (const int processes : {2, 5}) {
    const ProgramResult together =
        By(processes, SYSID_DIAGNOSE, arguments + Arguments{"--out", "found"});
    ASSERT_EQ(together.exit_code, 0) << together.err;
    EXPECT_EQ(WithoutTimes(Json::parse(together.out)), expected);
    const Json fit = Json::parse(folder_->Read("found/fit.json"));
    EXPECT_EQ(fit["processes"], processes);
  }
}

TEST_F(SearchProcessesTest, SayOnceWhatIsWrongWithTheInput) {
  const ProgramResult flag = By(
      3, SYSID_DIAGNOSE, {"--model", "pendulum2_planar", "--traj", "no.csv"});
  EXPECT_EQ(flag.exit_code, 2);
  EXPECT_THAT(flag.err, StartsWith("error: no.csv:"));
  // That the first process alone looks at.
  const ProgramResult out = By(3, SYSID_DIAGNOSE,
                               {"--model", "pendulum2_planar", "--traj",
                                "rubs1.csv", "--out", "rubs2.csv"});
  EXPECT_EQ(out.exit_code, 2);
  EXPECT_THAT(out.err, HasSubstr("--out"));
}

TEST_F(SearchProcessesTest, OfAComparisonHaveTheSameStarts) {
  const Arguments arguments = {"--model",  "pendulum2_planar",
                               "--traj",   "rubs1.csv",
                               "--free",   "link1.mass=0.9",
                               "--fix",    "link2.mass=1",
                               "--repeat", "3",
                               "--epochs", "20",
                               "--check",  "none",
                               "--json",   "-"};
  const ProgramResult alone = folder_->Run(SYSID_COMPARE, arguments);
  const ProgramResult together = By(2, SYSID_COMPARE, arguments);
  EXPECT_EQ(together.exit_code, alone.exit_code) << together.err;
  const Json expected = Json::parse(alone.out)["trials"];
  const Json starts = Json::parse(together.out)["trials"];
  ASSERT_EQ(expected.size(), 3u);
  EXPECT_EQ(WithoutTimes(starts), WithoutTimes(expected));
}

}  // namespace
}  // namespace sysid
