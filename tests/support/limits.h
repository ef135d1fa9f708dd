#pragma once

#include <sys/resource.h>

#include <algorithm>
#include <chrono>

namespace sysid {

// How much a test lets a program work, and how long it waits for what should
// come. What else the machine does changes no verdict: work is limited by
// processor time, to ten times what any program of the tests needs (under a
// minute), and waiting ends only where something hangs.
inline constexpr rlim_t kMostWork_s = 600;  // of the processor, for one program
inline constexpr std::chrono::minutes kHang{30};

// In a child that is to become a program: SIGXCPU ends it where it works
// longer.
inline void LimitWork() {
  rlimit work{};
  getrlimit(RLIMIT_CPU, &work);
  work.rlim_cur = std::min(work.rlim_cur, kMostWork_s);
  setrlimit(RLIMIT_CPU, &work);
  const rlimit no_core = {0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
}

}  // namespace sysid
