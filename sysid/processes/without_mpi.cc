#include <cstdlib>
#include <string>

#include "models/error.h"
#include "sysid/processes/process_group.h"

namespace sysid {

std::shared_ptr<ProcessGroup> ProcessGroup::Join() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}) {
    const char* const size = std::getenv(name);
    if (size == nullptr || std::string(size) == "1") continue;
    throw InputError("mpirun",
                     std::string("started ") + size +
                         " processes, but this build has no MPI: each would do "
                         "the same work",
                     "build where CMake finds MPI (libopenmpi-dev), or run one "
                     "process with --threads");
  }
  return nullptr;
}

}  // namespace sysid
