#pragma once

#include <functional>

namespace sysid {

// Calls work(0) .. work(count - 1), spread over `threads` threads. True where
// all returned true (the rest is skipped after the first false).
bool ParallelFor(int count, int threads, const std::function<bool(int)>& work);

}  // namespace sysid
