#pragma once

#include <functional>
#include <string>

#include "sysid/processes/process_group.h"

namespace sysid {

// RunProgram (program.h) for a program that mpirun or srun may start several
// times: `work` has the group of these processes; null where nobody did.
int RunOnProcesses(int argc, char** argv, const std::string& help,
                   const std::function<int(ProcessGroup*)>& work);

}  // namespace sysid
