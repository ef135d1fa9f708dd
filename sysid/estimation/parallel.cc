#include "sysid/estimation/parallel.h"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace sysid {

bool ParallelFor(int count, int threads, const std::function<bool(int)>& work) {
  std::atomic<int> next{0};
  std::atomic<bool> ok{true};
  const auto loop = [&] {
    for (int i = next++; i < count && ok; i = next++) {
      if (!work(i)) ok = false;
    }
  };
  std::vector<std::thread> others;
  for (int i = 1; i < std::min(threads, count); ++i) others.emplace_back(loop);
  loop();
  for (std::thread& thread : others) thread.join();
  return ok;
}

}  // namespace sysid
