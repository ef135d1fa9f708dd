// sysid/processes/without_mpi.cc, which this program has in place of MPI.

#include <gmock/gmock.h>

#include <cstdlib>

#include "models/error.h"
#include "sysid/processes/process_group.h"

namespace sysid {
namespace {

class WithoutMpiTest : public ::testing::Test {
 protected:
  WithoutMpiTest() {
    for (const char* const name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}) {
      unsetenv(name);
    }
  }
};

TEST_F(WithoutMpiTest, OneProcessHasAllRuns) {
  EXPECT_EQ(ProcessGroup::Join(), nullptr);
  setenv("OMPI_COMM_WORLD_SIZE", "1", 1);
  EXPECT_EQ(ProcessGroup::Join(), nullptr);
}

TEST_F(WithoutMpiTest, RefusesToDoTheSameWorkManyTimes) {
  setenv("PMI_SIZE", "4", 1);
  try {
    ProcessGroup::Join();
    ADD_FAILURE() << "joined";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "mpirun: started 4 processes, but this build has no MPI: each "
                 "would do the same work\n  hint: build where CMake finds MPI "
                 "(libopenmpi-dev), or run one process with --threads");
  }
}

}  // namespace
}  // namespace sysid
