#pragma once

#include <functional>

namespace sysid {

// Calls work(0) .. work(count - 1), spread over `threads` threads. True where
// all returned true (the rest is skipped after the first false). The threads
// beside the caller's are kept for later calls: one that is new may wait
// milliseconds for a core of its own. Calls may be nested.
bool ParallelFor(int count, int threads, const std::function<bool(int)>& work);

// The same with the number of the thread that does it, work(i, thread), for
// scratch of one thread each: 0 (the caller's) to threads - 1.
bool ParallelFor(int count, int threads,
                 const std::function<bool(int, int)>& work);

}  // namespace sysid
