// sysid_fit as packages have it, without MPI: SYSID_FIT_WITHOUT_MPI.

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/tools/programs.h"

namespace sysid {
namespace {

// What mpirun and srun say to those that they start.
constexpr const char* kSizes[] = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"};
constexpr const char* kOfSlurm[] = {"SLURM_STEP_NUM_TASKS", "SLURM_PROCID"};

class WithoutMpiTest : public ::testing::Test {
 protected:
  WithoutMpiTest() {
    Forget();
    SimulateInto(folder_, "run.csv",
                 {"--model", "pendulum2_planar", "--duration", "2"});
  }
  ~WithoutMpiTest() override { Forget(); }

  static void Forget() {
    for (const char* const name : kSizes) unsetenv(name);
    for (const char* const name : kOfSlurm) unsetenv(name);
  }

  const ProgramFolder folder_;
  const Arguments fit_ = {"--model", "pendulum2_planar",  "--traj", "run.csv",
                          "--free",  "link1.length=0.45", "--json", "-"};
};

TEST_F(WithoutMpiTest, LinksNone) {
  std::ifstream file(SYSID_FIT_WITHOUT_MPI, std::ios::binary);
  const std::string program{std::istreambuf_iterator<char>(file), {}};
  ASSERT_NE(program.find("libglog.so"), std::string::npos);
  EXPECT_EQ(program.find("libmpi"), std::string::npos);
}

TEST_F(WithoutMpiTest, FitsAsWithIt) {
  using Json = nlohmann::json;
  std::vector<Json> fits;
  for (const std::string program : {SYSID_FIT, SYSID_FIT_WITHOUT_MPI}) {
    const ProgramResult result = folder_.Run(program, fit_);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    fits.push_back(Json::parse(result.out));
  }
  EXPECT_EQ(fits[0]["parameters"], fits[1]["parameters"]);
  EXPECT_EQ(fits[0]["error"], fits[1]["error"]);
}

TEST_F(WithoutMpiTest, RefusesToDoTheSameWorkManyTimes) {
  for (const char* const name : kSizes) {
    setenv(name, "4", 1);
    ExpectRefused(folder_, SYSID_FIT_WITHOUT_MPI, fit_, "mpirun",
                  "started 4 processes, but this build has no MPI: each would "
                  "do the same work",
                  "libopenmpi-dev");
    // One process of mpirun's has all runs.
    setenv(name, "1", 1);
    EXPECT_EQ(folder_.Run(SYSID_FIT_WITHOUT_MPI, fit_).exit_code, 0);
    unsetenv(name);
  }
}

// Tasks of srun without MPI may be meant to be on their own.
TEST_F(WithoutMpiTest, TheFirstOfSeparateTasksSaysThatTheyAre) {
  setenv("SLURM_STEP_NUM_TASKS", "3", 1);
  for (const std::string task : {"0", "1"}) {
    setenv("SLURM_PROCID", task.c_str(), 1);
    for (const std::string program : {SYSID_FIT, SYSID_FIT_WITHOUT_MPI}) {
      const ProgramResult result = folder_.Run(program, fit_);
      EXPECT_EQ(result.exit_code, 0) << result.err;
      EXPECT_EQ(result.err.find("srun started 3 tasks") != std::string::npos,
                task == "0")
          << result.err;
    }
  }
}

}  // namespace
}  // namespace sysid
