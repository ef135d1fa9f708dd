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

// Whatever it waits for, and where nothing can be asked.
TEST(StopLater, EndsAtOnce) {
  std::stop_source first;
  const auto begin = std::chrono::steady_clock::now();
  {
    const StopLater never(first.get_token());
    const StopLater nothing{std::stop_token()};
  }
  first.request_stop();
  { const StopLater waits(first.get_token()); }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, StopLater::kGrace);
}

}  // namespace
}  // namespace sysid
