#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// A stop that follows another one some time later: for what makes a point worth
// keeping. That is short, but of a model that needs tiny steps.
class StopLater {
 public:
  // A program is to end within a second of Ctrl-C, and has files to write yet.
  static constexpr std::chrono::milliseconds kGrace{200};

  explicit StopLater(std::stop_token first,
                     std::chrono::milliseconds later = kGrace)
      : thread_([this, first = std::move(first), later](
                    const std::stop_token& own) { Wait(first, later, own); }) {}
  std::stop_token token() const { return source_.get_token(); }

 private:
  void Wait(const std::stop_token& first, std::chrono::milliseconds later,
            const std::stop_token& own) {
    std::mutex mutex;
    std::condition_variable_any changed;
    const std::stop_callback wake(first, [&] {
      const std::lock_guard lock(mutex);
      changed.notify_all();
    });
    std::unique_lock lock(mutex);
    changed.wait(lock, own, [&] { return first.stop_requested(); });
    changed.wait_for(lock, own, later, [] { return false; });
    if (!own.stop_requested()) source_.request_stop();
  }

  std::stop_source source_;
  std::jthread thread_;  // ends with this
};

// The options for what makes a point of a problem worth keeping, where it may
// be stopped with one; `later` is of its stop. Processes would not end at the
// same time: theirs go on to the end.
inline EstimationOptions WithGrace(const ShootingProblem& problem,
                                   const StopLater& later) {
  EstimationOptions options = problem.options();
  if (!options.keep_best) return options;
  options.stop =
      problem.processes().size() > 1 ? std::stop_token() : later.token();
  return options;
}

}  // namespace sysid
