#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/fit_setup.h"
#include "tests/sysid/estimation/simulated.h"

namespace sysid {
namespace {

constexpr double kNoise = 1e-3;  // rad

// Where a model misses one channel and not the other, what it says of the
// other is not bent: channels are weighed by what is left of them. (Weighed by
// the noise alone the lengths end at 0.73 and 0.66 m, joint1 at 40 times its
// noise.)
TEST(ChannelWeights, KeepWhatAChannelSaysFromTheMisfitOfAnother) {
  const std::vector<Value> truth = {{"link1.length", 0.6},
                                    {"link2.length", 0.8}};
  const Model model = Shipped("pendulum2_planar");
  Model moved = model;
  Set(truth, &moved);
  SimulationOptions options;
  options.duration = 6.0;
  options.noise = kNoise;
  options.seed = 3;
  sysid::Run run = Simulate(moved, RandomState(moved, 0.4, 5), options);
  // The second encoder sits on a bracket that sways.
  for (Channel& channel : run.channels) {
    if (channel.name.find("joint2") == std::string::npos) continue;
    for (int k = 0; k < run.size(); ++k) {
      channel.values(k, 0) += 0.2 * std::sin(6.0 * run.t[k]);
    }
  }
  const Fit fit = FitRuns(
      model, FreeFrom(model, {{"link1.length", 0.5}, {"link2.length", 0.7}}),
      {run});
  for (const Value& value : truth) {
    const ParameterEstimate& p = EstimateOf(fit, value.name);
    EXPECT_LT(std::abs(p.value - value.value), 4.0 * p.std_error)
        << p.name << " " << p.value << " +- " << p.std_error;
    EXPECT_NEAR(p.value, value.value, 0.01 * value.value) << p.name;
  }
  ASSERT_EQ(fit.train.channels.size(), 2u);
  EXPECT_LT(fit.train.channels[0].normalized_rms, 1.2);
  EXPECT_GT(fit.train.channels[1].normalized_rms, 100.0);
}

// Spikes of one channel are bent by the loss, and do not weaken the channel.
TEST(ChannelWeights, LeaveOutliersToARobustLoss) {
  const std::vector<Value> truth = {{"link1.length", 0.4},
                                    {"link2.length", 0.3}};
  const Model start = Shipped("pendulum2_planar");
  const sysid::Run clean =
      Simulated(Shipped("pendulum2_planar", {}, truth), 0.6, 7);
  sysid::Run spiked = clean;
  for (int k = 50; k < spiked.size(); k += 100) {
    spiked.channels[0].values(k, 0) += k % 200 == 50 ? 0.3 : -0.3;
  }
  const auto free =
      FreeFrom(start, {{"link1.length", 0.5}, {"link2.length", 0.4}});
  EstimationOptions options;
  options.noise = kNoise;
  options.loss = RobustLoss::kHuber;
  const Fit without = FitRuns(start, free, {clean}, options);
  const Fit with = FitRuns(start, free, {spiked}, options);
  EXPECT_GT(with.train.total.normalized_rms, 10.0);
  for (const Value& value : truth) {
    const double one = EstimateOf(without, value.name).std_error;
    EXPECT_LT(std::abs(EstimateOf(with, value.name).value - value.value),
              4.0 * one)
        << value.name;
  }
  // Weighed by its spikes the channel would be next to none.
  EXPECT_TRUE(with.misfit.empty());
}

}  // namespace
}  // namespace sysid
