#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/no_signals.h"

namespace sysid {

// The time that a work may take: asks it to stop where someone outside does, or
// once `seconds` have passed since this was made (infinity: only the first).
class TimeLimit {
 public:
  TimeLimit(std::stop_token outside, double seconds)
      : outside_(std::move(outside)),
        asked_(outside_, [this] { source_.request_stop(); }) {
    constexpr double kLongest = 1e8;  // s, that clocks can count
    if (std::isinf(seconds)) return;
    const NoSignals in_it;
    thread_ = std::jthread(
        [this, end = std::chrono::steady_clock::now() +
                     std::chrono::duration_cast<std::chrono::milliseconds>(
                         std::chrono::duration<double>(std::min(
                             seconds, kLongest)))](const std::stop_token& own) {
          std::mutex mutex;
          std::condition_variable_any changed;
          std::unique_lock lock(mutex);
          changed.wait_until(lock, own, end, [] { return false; });
          if (!own.stop_requested()) source_.request_stop();
        });
  }

  std::stop_token stop() const { return source_.get_token(); }
  StoppedBy stopped_by() const {
    if (!source_.stop_requested()) return StoppedBy::kNobody;
    return outside_.stop_requested() ? StoppedBy::kUser : StoppedBy::kTime;
  }

 private:
  const std::stop_token outside_;
  std::stop_source source_;
  const std::stop_callback<std::function<void()>> asked_;
  std::jthread thread_;  // ends with this
};

}  // namespace sysid
