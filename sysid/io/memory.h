#pragma once

#include <string>

namespace sysid {

// Bytes that this process can ever have: the machine's memory, or less where a
// container (cgroup) or a limit of the process (ulimit -v) says so.
double MemoryLimit();

// Before something is allocated whose size comes from outside. Throws
// InputError at `place` where `bytes` are more than MemoryLimit(): "`what`
// needs 3.2 GB, and this machine has 2 GB".
void CheckMemory(double bytes, const std::string& place,
                 const std::string& what, const std::string& hint);

}  // namespace sysid
