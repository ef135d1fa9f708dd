#include "sysid/estimation/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "sysid/estimation/cancelled.h"

namespace sysid {

bool ParallelFor(int count, int threads, const std::function<bool(int)>& work) {
  return ParallelFor(count, threads, std::stop_token(), work);
}

bool ParallelFor(int count, int threads, const std::stop_token& stop,
                 const std::function<bool(int)>& work) {
  std::atomic<int> next{0};
  std::atomic<bool> ok{true};
  std::mutex mutex;
  std::exception_ptr thrown;  // the first
  const auto loop = [&] {
    try {
      for (int i = next++; i < count && ok; i = next++) {
        ThrowIfCancelled(stop);
        if (!work(i)) ok = false;
      }
    } catch (...) {
      ok = false;
      const std::lock_guard lock(mutex);
      if (thrown == nullptr) thrown = std::current_exception();
    }
  };
  std::vector<std::thread> others;
  for (int i = 1; i < std::min(threads, count); ++i) others.emplace_back(loop);
  loop();
  for (std::thread& thread : others) thread.join();
  if (thrown != nullptr) std::rethrow_exception(thrown);
  return ok;
}

}  // namespace sysid
