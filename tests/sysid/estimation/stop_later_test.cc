#include "sysid/estimation/stop_later.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace sysid {
namespace {

using std::chrono::milliseconds;

TEST(StopLater, StopsOnlyAfterTheFirstIsAsked) {
  std::stop_source first;
  const StopLater later(first.get_token(), milliseconds(20));
  std::this_thread::sleep_for(milliseconds(60));
  EXPECT_FALSE(later.token().stop_requested());
  const auto asked = std::chrono::steady_clock::now();
  first.request_stop();
  while (!later.token().stop_requested()) std::this_thread::yield();
  EXPECT_GE(std::chrono::steady_clock::now() - asked, milliseconds(20));
}

TEST(StopLater, StopsWhereTheFirstWasAskedBefore) {
  std::stop_source first;
  first.request_stop();
  const StopLater later(first.get_token(), milliseconds(0));
  while (!later.token().stop_requested()) std::this_thread::yield();
}

// Whatever it waits for, and where nothing can be asked: otherwise this takes
// days.
TEST(StopLater, EndsAtOnce) {
  constexpr std::chrono::hours kDays{100};
  std::stop_source first;
  {
    const StopLater never(first.get_token(), kDays);
    const StopLater nothing{std::stop_token(), kDays};
  }
  first.request_stop();
  { const StopLater waits(first.get_token(), kDays); }
}

}  // namespace
}  // namespace sysid
