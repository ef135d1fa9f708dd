#include "sysid/io/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "models/error.h"
#include "sysid/io/cell.h"

namespace sysid {
namespace {

std::string Amount(double bytes) {
  constexpr double kThousand = 1e3;
  const char* units[] = {"B", "kB", "MB", "GB", "TB", "PB", "EB"};
  size_t unit = 0;
  for (; bytes >= kThousand && unit + 1 < std::size(units); ++unit) {
    bytes /= kThousand;
  }
  return Format("%.3g %s", bytes, units[unit]);
}

}  // namespace

double MemoryLimit() {
  double limit = static_cast<double>(sysconf(_SC_PHYS_PAGES)) *
                 static_cast<double>(sysconf(_SC_PAGESIZE));
  rlimit space{};
  if (getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY) {
    limit = std::min(limit, static_cast<double>(space.rlim_cur));
  }
  // Version 2 and 1; "max" is no number and stays unread.
  for (const char* file : {"/sys/fs/cgroup/memory.max",
                           "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
    double bytes = 0.0;
    if (std::ifstream(file) >> bytes && bytes > 0) {
      limit = std::min(limit, bytes);
    }
  }
  return limit;
}

void CheckMemory(double bytes, const std::string& place,
                 const std::string& what, const std::string& hint) {
  const double limit = MemoryLimit();
  if (bytes <= limit) return;
  throw InputError(place,
                   what + " needs " + Amount(bytes) +
                       " of memory, and this machine has " + Amount(limit),
                   hint);
}

}  // namespace sysid
