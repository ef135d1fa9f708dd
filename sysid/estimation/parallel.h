#pragma once

#include <functional>
#include <stop_token>

namespace sysid {

// Calls work(0) .. work(count - 1), spread over `threads` threads. True where
// all returned true (the rest is skipped after the first false). What one of
// them throws is thrown here, once all have ended. The threads beside the
// caller's are kept for later calls: one that is new may wait milliseconds for
// a core of its own. Calls may be nested.
bool ParallelFor(int count, int threads, const std::function<bool(int)>& work);

// The same for long work: throws Cancelled where `stop` asks for it.
bool ParallelFor(int count, int threads, const std::stop_token& stop,
                 const std::function<bool(int)>& work);

// The same with the number of the thread that does it, work(i, thread), for
// scratch of one thread each: 0 (the caller's) to threads - 1.
bool ParallelFor(int count, int threads,
                 const std::function<bool(int, int)>& work);

// Calls work(first, last) for [0, count) in ranges of `size`, the last one
// shorter, spread alike: what a range is does not depend on the threads.
void ParallelRanges(int count, int size, int threads,
                    const std::function<void(int, int)>& work);

// How many threads each of `count` works has that are spread over `threads`.
int ThreadsOfEach(int count, int threads);

}  // namespace sysid
