// The programs of a build that found no Stan Math.

#include "tests/tools/programs.h"

namespace sysid {
namespace {

TEST(WithoutStan, SolversSayHowToGetThem) {
  const ProgramFolder folder;
  const std::string run = std::string(SYSID_SOURCE) + "/data/runs/figure1.csv";
  for (const char* solver : {"adam", "gmm"}) {
    ExpectRefused(folder, SYSID_FIT,
                  {"--model", "pendulum2", "--traj", run, "--solver", solver},
                  "--solver",
                  std::string("this build has no solver '") + solver + "'",
                  "apt-get install --no-install-recommends "
                  "r-cran-stanheaders libboost-dev");
  }
  ExpectRefused(folder, SYSID_COMPARE, {"--model", "pendulum2", "--traj", run},
                "sysid_compare", "this build has no Adam",
                "r-cran-stanheaders");
  EXPECT_EQ(
      folder.Run(SYSID_FIT, {"--model", "pendulum2", "--traj", run}).exit_code,
      0);
}

}  // namespace
}  // namespace sysid
