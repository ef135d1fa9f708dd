#include "tools/on_processes.h"

#include <cstdio>
#include <memory>

#include "models/error.h"
#include "tools/program.h"

namespace sysid {

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
  return group == nullptr ? program() : group->Run(program);
}

}  // namespace sysid
