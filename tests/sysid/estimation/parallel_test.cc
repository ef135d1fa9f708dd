#include "sysid/estimation/parallel.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <thread>
#include <vector>

namespace sysid {
namespace {

using testing::Each;
using testing::Eq;

TEST(ParallelFor, DoesEverythingOnce) {
  for (const int threads : {0, 1, 2, 3, 8}) {
    for (const int count : {0, 1, 2, 100}) {
      std::vector<std::atomic<int>> times(count);
      EXPECT_TRUE(ParallelFor(count, threads, [&](int i) {
        ++times[i];
        return true;
      }));
      for (const auto& t : times) EXPECT_EQ(t, 1);
    }
  }
}

TEST(ParallelRanges, AreTheSameByAnyNumberOfThreads) {
  for (const int threads : {1, 3}) {
    for (const int count : {0, 1, 7, 8, 20}) {
      std::vector<std::atomic<int>> last_of(count);
      ParallelRanges(count, 4, threads, [&](int first, int last) {
        for (int i = first; i < last; ++i) last_of[i] += last;
      });
      for (int i = 0; i < count; ++i) {
        EXPECT_EQ(last_of[i], std::min(count, i / 4 * 4 + 4));
      }
    }
  }
}

TEST(ThreadsOfEach, SharesThemOut) {
  EXPECT_EQ(ThreadsOfEach(1, 8), 8);
  EXPECT_EQ(ThreadsOfEach(3, 8), 2);
  EXPECT_EQ(ThreadsOfEach(20, 8), 1);
  EXPECT_EQ(ThreadsOfEach(0, 2), 2);
  EXPECT_EQ(ThreadsOfEach(2, 0), 1);
}

TEST(ParallelFor, SkipsTheRestAfterAFailure) {
  int done = 0;
  EXPECT_FALSE(ParallelFor(10, 1, [&](int i) {
    ++done;
    return i != 3;
  }));
  EXPECT_EQ(done, 4);
  EXPECT_FALSE(ParallelFor(10, 3, [](int i) { return i != 3; }));
}

// Both wait until the other has begun: one thread alone would never end.
TEST(ParallelFor, IsDoneByThreadsAtATime) {
  for (int round = 0; round < 20; ++round) {
    std::atomic<int> begun{0};
    EXPECT_TRUE(ParallelFor(2, 2, [&](int) {
      ++begun;
      while (begun < 2) std::this_thread::yield();
      return true;
    }));
  }
}

TEST(ParallelFor, SaysWhichThreadWorks) {
  constexpr int kThreads = 3;
  const std::thread::id caller = std::this_thread::get_id();
  for (int round = 0; round < 10; ++round) {
    std::vector<std::atomic<bool>> busy(kThreads);
    std::atomic<int> shared{0}, strange{0};
    ParallelFor(30, kThreads, [&](int, int thread) {
      if ((thread == 0) != (std::this_thread::get_id() == caller)) ++strange;
      if (busy[thread].exchange(true)) ++shared;
      std::this_thread::yield();
      busy[thread] = false;
      return true;
    });
    EXPECT_EQ(shared, 0);
    EXPECT_EQ(strange, 0);
  }
}

// Counted by what is new in each thread: its id may be that of one that ended.
TEST(ParallelFor, KeepsItsThreads) {
  constexpr int kRounds = 50;
  std::atomic<int> born{0};
  for (int round = 0; round < kRounds; ++round) {
    std::atomic<int> begun{0};
    ParallelFor(2, 2, [&](int) {
      static thread_local bool known = false;
      if (!known) ++born;
      known = true;
      ++begun;
      while (begun < 2) std::this_thread::yield();
      return true;
    });
  }
  // Helpers that earlier tests left may take turns.
  EXPECT_LT(born, kRounds / 2);
}

// A program that waits for Ctrl-C blocks it first; a helper that was made
// before must not be where it is taken.
TEST(ParallelFor, LeavesSignalsToTheProgram) {
  const std::thread::id caller = std::this_thread::get_id();
  std::atomic<int> open = 0;
  ParallelFor(64, 4, [&](int) {
    sigset_t blocked;
    pthread_sigmask(SIG_SETMASK, nullptr, &blocked);
    const bool takes = sigismember(&blocked, SIGINT) == 0;
    if (takes != (std::this_thread::get_id() == caller)) ++open;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return true;
  });
  EXPECT_EQ(open, 0);
}

// Address space for a few stacks more, and work for 400 threads.
[[noreturn]] void WorkWithFewThreads() {
  long pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const rlim_t now = static_cast<rlim_t>(pages) * 4096;
  const rlimit few = {now + (64 << 20), now + (64 << 20)};
  std::atomic<int> done = 0;
  const bool ok =
      setrlimit(RLIMIT_AS, &few) == 0 && ParallelFor(1000, 400, [&](int) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        ++done;
        return true;
      });
  std::_Exit(ok && done == 1000 ? 0 : 1);
}

TEST(ParallelForDeathTest, DoesWithTheThreadsThatAreToBeHad) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer needs the address space";
#endif
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "the sanitizer needs the address space";
#endif
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(WorkWithFewThreads(), testing::ExitedWithCode(0), "");
}

TEST(ParallelFor, MayBeNestedAndCalledByManyThreads) {
  constexpr int kOuter = 8, kInner = 50;
  std::vector<int> sums(4);
  std::vector<std::thread> callers;
  for (int& sum : sums) {
    callers.emplace_back([&sum] {
      std::atomic<int> count{0};
      for (int round = 0; round < 20; ++round) {
        ParallelFor(kOuter, 3, [&](int) {
          return ParallelFor(kInner, 2, [&](int) {
            ++count;
            return true;
          });
        });
      }
      sum = count;
    });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_THAT(sums, Each(Eq(20 * kOuter * kInner)));
}

// The helpers, which use what is the caller's, have ended by then.
TEST(ParallelFor, PassesOnWhatItsCallerThrows) {
  const std::thread::id caller = std::this_thread::get_id();
  std::atomic<int> begun{0};
  const auto both = [&](int) {
    ++begun;
    while (begun < 2) std::this_thread::yield();
    if (std::this_thread::get_id() == caller) {
      throw std::runtime_error("no more");
    }
    return true;
  };
  EXPECT_THROW(ParallelFor(2, 2, both), std::runtime_error);
}

}  // namespace
}  // namespace sysid
