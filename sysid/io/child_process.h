#pragma once

#include <sys/types.h>

#include <cstdint>
#include <cstdio>
#include <functional>
#include <string>

namespace sysid {

// Work that is done in a process of its own, for libraries that damaged files
// crash or hang: whatever happens there, here it is a text. What it finds it
// writes to a pipe; its standard error is not shown.
class ChildProcess {
 public:
  // Starts `work`, which must not throw and is given `cpu_seconds` of a
  // processor.
  ChildProcess(const std::function<void(std::FILE* out)>& work,
               int64_t cpu_seconds);
  // Kills it where it still runs.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  // What it writes.
  std::FILE* out() const { return out_; }
  // Waits for its end, once: "" or how it failed, "Segmentation fault".
  std::string Finish();

 private:
  pid_t pid_ = -1;
  std::string failure_;  // where it could not be started
  std::FILE* out_ = nullptr;
};

}  // namespace sysid
