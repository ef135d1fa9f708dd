#pragma once

#include <chrono>
#include <ctime>

namespace sysid {

// Seconds of a steady clock.
inline double Now() {
  return std::chrono::duration<double>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

// Processor seconds of this process so far, all threads together.
inline double CpuSeconds() {
  timespec spent{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &spent);
  return static_cast<double>(spent.tv_sec) + 1e-9 * spent.tv_nsec;
}

}  // namespace sysid
