#include "sysid/estimation/parallel.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/no_signals.h"

namespace sysid {
namespace {

// The threads that help, and the calls that wait for help. Never destroyed: the
// threads last as long as the process.
class Helpers {
 public:
  static Helpers& Instance() {
    static Helpers* const instance = new Helpers;
    return *instance;
  }

  // A call that helpers may join, each with a number of its own, until it goes
  // out of scope; that waits for those who have joined.
  class Call {
   public:
    Call(int helpers, const std::function<void(int)>& loop)
        : loop_(loop), places_(helpers) {
      Instance().Offer(this);
    }
    ~Call() { Instance().Close(this); }
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

   private:
    friend class Helpers;
    const std::function<void(int)>& loop_;
    int places_;  // that are still free
    int joined_ = 0;
    int inside_ = 0;
    std::condition_variable left_;
  };

 private:
  void Offer(Call* call) {
    const std::lock_guard<std::mutex> lock(mutex_);
    open_.push_back(call);
    places_ += call->places_;
    const NoSignals in_them;
    try {
      for (; idle_ < places_; ++idle_) {
        std::thread(&Helpers::Help, this).detach();
      }
    } catch (const std::exception&) {
      // No more threads to be had: those that are there do it.
    }
    wake_.notify_all();
  }

  void Close(Call* call) {
    std::unique_lock<std::mutex> lock(mutex_);
    places_ -= call->places_;
    std::erase(open_, call);
    call->left_.wait(lock, [call] { return call->inside_ == 0; });
  }

  void Help() {
    std::unique_lock<std::mutex> lock(mutex_);
    for (;;) {
      wake_.wait(lock, [this] { return !open_.empty(); });
      Call* const call = open_.back();
      const int number = ++call->joined_;
      ++call->inside_;
      --places_;
      --idle_;
      if (--call->places_ == 0) std::erase(open_, call);
      lock.unlock();
      call->loop_(number);
      lock.lock();
      ++idle_;
      if (--call->inside_ == 0) call->left_.notify_one();
    }
  }

  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Call*> open_;  // with free places
  int places_ = 0;           // of all open calls
  int idle_ = 0;             // threads that wait, or are about to
};

}  // namespace

bool ParallelFor(int count, int threads,
                 const std::function<bool(int, int)>& work) {
  std::atomic<int> next{0};
  std::atomic<bool> ok{true};
  std::mutex mutex;
  std::exception_ptr thrown;  // the first
  const std::function<void(int)> loop = [&](int thread) {
    try {
      for (int i = next++; i < count && ok; i = next++) {
        if (!work(i, thread)) ok = false;
      }
    } catch (...) {
      ok = false;
      const std::lock_guard lock(mutex);
      if (thrown == nullptr) thrown = std::current_exception();
    }
  };
  const int helpers = std::min(threads, count) - 1;
  if (helpers > 0) {
    const Helpers::Call call(helpers, loop);
    loop(0);
  } else {
    loop(0);
  }
  if (thrown != nullptr) std::rethrow_exception(thrown);
  return ok;
}

bool ParallelFor(int count, int threads, const std::function<bool(int)>& work) {
  return ParallelFor(count, threads, [&](int i, int) { return work(i); });
}

bool ParallelFor(int count, int threads, const std::stop_token& stop,
                 const std::function<bool(int)>& work) {
  ThrowIfCancelled(stop);  // also where there is nothing to do
  return ParallelFor(count, threads, [&](int i, int) {
    ThrowIfCancelled(stop);
    return work(i);
  });
}

void ParallelRanges(int count, int size, int threads,
                    const std::function<void(int, int)>& work) {
  ParallelFor((count + size - 1) / size, threads, [&](int i) {
    work(i * size, std::min(count, (i + 1) * size));
    return true;
  });
}

int ThreadsOfEach(int count, int threads) {
  return std::max(1, threads / std::clamp(count, 1, std::max(1, threads)));
}

}  // namespace sysid
