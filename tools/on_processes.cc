#include "tools/on_processes.h"

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include "models/error.h"
#include "tools/program.h"

namespace sysid {
namespace {

// Where srun started several tasks that do not know each other: each is the
// whole of its own work, which may be meant. The first one says it.
void SayWhetherTasksAreSeparate() {
  const auto value = [](const char* name) -> std::string {
    const char* const text = std::getenv(name);
    return text == nullptr ? "" : text;
  };
  const std::string tasks = value("SLURM_STEP_NUM_TASKS");
  if (tasks.empty() || tasks == "1" || value("SLURM_PROCID") != "0") return;
  std::fprintf(stderr,
               "srun started %s tasks, but without MPI: each does all of its "
               "work by itself; for one fit over all of them: srun --mpi=pmix "
               "and a build with MPI\n",
               tasks.c_str());
}

}  // namespace

int RunOnProcesses(int argc, char** argv, const std::string& help,
                   const std::function<int(ProcessGroup*)>& work) {
  std::shared_ptr<ProcessGroup> group;
  const auto program = [&] {
    return RunProgram(argc, argv, help, [&] { return work(group.get()); });
  };
  try {
    group = ProcessGroup::Join();
  } catch (const InputError& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return kExitBadInput;
  }
  if (group != nullptr) return group->Run(program);
  SayWhetherTasksAreSeparate();
  return program();
}

}  // namespace sysid
