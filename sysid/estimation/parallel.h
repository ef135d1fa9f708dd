#pragma once

#include <functional>
#include <stop_token>

namespace sysid {

// Calls work(0) .. work(count - 1), spread over `threads` threads. True where
// all returned true (the rest is skipped after the first false). What one of
// them throws is thrown here, once all threads have ended.
bool ParallelFor(int count, int threads, const std::function<bool(int)>& work);

// The same for long work: throws Cancelled where `stop` asks for it.
bool ParallelFor(int count, int threads, const std::stop_token& stop,
                 const std::function<bool(int)>& work);

}  // namespace sysid
