#include "sysid/estimation/clock.h"

#include <chrono>
#include <ctime>

namespace sysid {

double Now() {
  return std::chrono::duration<double>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

double CpuSeconds() {
  timespec spent{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &spent);
  return static_cast<double>(spent.tv_sec) + 1e-9 * spent.tv_nsec;
}

}  // namespace sysid
