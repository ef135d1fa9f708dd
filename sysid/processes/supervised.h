#pragma once

#include <string>

namespace sysid {

// Goes on in a child process. The process that called waits for it and ends as
// it ended: with its exit code, or, where a signal killed it, with exit code 1
// and a line that says who (`name`) and why. So a launcher of MPI, which ends a
// job by 128 + the signal of a process that it knows, ends it by an exit code
// of this program. Interrupts (SIGINT, SIGTERM) of the waiting process are
// passed on. To be called while there is one thread.
void ContinueSupervised(const std::string& name);

}  // namespace sysid
