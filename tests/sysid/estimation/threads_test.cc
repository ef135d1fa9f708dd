#include <gmock/gmock.h>

#include <atomic>
#include <cmath>

#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/parallel.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

TEST(ParallelFor, CallsEachOnce) {
  for (const int threads : {1, 2, 4, 100}) {
    std::vector<std::atomic<int>> calls(50);
    EXPECT_TRUE(ParallelFor(50, threads, [&](int i) {
      ++calls[i];
      return true;
    }));
    for (const auto& count : calls) EXPECT_EQ(count, 1);
  }
  EXPECT_TRUE(ParallelFor(0, 4, [](int) { return false; }));
}

TEST(ParallelFor, IsFalseWhereAnyFails) {
  for (const int threads : {1, 3}) {
    EXPECT_FALSE(ParallelFor(50, threads, [](int i) { return i != 20; }));
  }
}

TEST(ParallelFor, ThrowsWhatTheWorkThrows) {
  for (const int threads : {1, 3}) {
    EXPECT_THROW(ParallelFor(50, threads,
                             [](int i) -> bool {
                               if (i == 20) throw std::runtime_error("20");
                               return true;
                             }),
                 std::runtime_error);
  }
}

TEST(ParallelFor, EndsWhereItIsStopped) {
  for (const int threads : {1, 3}) {
    std::stop_source stop;
    std::atomic<int> calls = 0;
    EXPECT_THROW(ParallelFor(1000, threads, stop.get_token(),
                             [&](int) {
                               if (++calls == 20) stop.request_stop();
                               return true;
                             }),
                 Cancelled);
    EXPECT_LE(calls, 20 + threads);
  }
}

TEST(Fit, IsTheSameForOneThreadAndTwo) {
  const std::vector<Value> truth = {{"link1.length", 0.4},
                                    {"link2.length", 0.3}};
  const Model planted = Shipped("pendulum2_planar", {}, truth);
  const Model start = Shipped("pendulum2_planar");
  SimulationOptions simulation;
  simulation.duration = 2.0;
  simulation.noise = 1e-3;
  std::vector<sysid::Run> runs;
  for (int seed = 1; seed <= 2; ++seed) {
    simulation.seed = seed;
    runs.push_back(
        Simulate(planted, RandomState(planted, 0.6, seed), simulation));
  }
  const auto fit = [&](int threads) {
    EstimationOptions options;
    options.threads = threads;
    return FitRuns(
        start, FreeFrom(start, {{"link1.length", 0.5}, {"link2.length", 0.4}}),
        runs, options);
  };
  const Fit one = fit(1), two = fit(2);
  ASSERT_EQ(one.parameters.size(), two.parameters.size());
  for (size_t i = 0; i < one.parameters.size(); ++i) {
    const ParameterEstimate& a = one.parameters[i];
    const ParameterEstimate& b = two.parameters[i];
    EXPECT_NEAR(a.value, b.value, 1e-6 * std::abs(a.value));
    EXPECT_NEAR(a.std_error, b.std_error, 1e-6 * a.std_error);
  }
  EXPECT_NEAR(one.train.total.normalized_rms, two.train.total.normalized_rms,
              1e-6);
}

}  // namespace
}  // namespace sysid
