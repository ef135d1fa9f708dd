#include <gmock/gmock.h>

#include <cmath>
#include <iostream>

#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

// Planted parameters over many seeds: recovered, and with intervals that hold
// the truth as often as they say. With 80 or 120 intervals of 95 % the count of
// those that do lies between 85 % and 100 % but in one of a thousand cases.
constexpr int kSeeds = 40;

struct Calibration {
  int intervals = 0;
  int hold = 0;
  double squares = 0.0;  // of deviations in standard errors
};

void Add(const Fit& fit, const std::vector<Value>& truth, int seed,
         Calibration* calibration) {
  EXPECT_TRUE(fit.converged) << "seed " << seed << ": " << fit.termination;
  EXPECT_NEAR(fit.train.total.normalized_rms, 1.0, 0.15) << "seed " << seed;
  for (const Value& value : truth) {
    const ParameterEstimate& estimate = EstimateOf(fit, value.name);
    const double deviation = Deviation(fit, value);
    EXPECT_LT(std::abs(deviation), 5.0) << value.name << ", seed " << seed;
    ++calibration->intervals;
    calibration->hold +=
        estimate.ci95[0] <= value.value && value.value <= estimate.ci95[1];
    calibration->squares += deviation * deviation;
  }
}

void ExpectCalibrated(const Calibration& calibration) {
  const double coverage = double(calibration.hold) / calibration.intervals;
  EXPECT_GE(coverage, 0.85);
  EXPECT_LE(coverage, 1.0);
  // Neither too proud nor too modest.
  const double rms = std::sqrt(calibration.squares / calibration.intervals);
  EXPECT_GT(rms, 0.7);
  EXPECT_LT(rms, 1.4);
  std::cout << calibration.hold << " of " << calibration.intervals
            << " intervals hold the truth; deviations of " << rms
            << " standard errors\n";
}

TEST(Calibration, OfThePlanarDoublePendulumsLengths) {
  const std::vector<Value> truth = {{"link1.length", 0.42},
                                    {"link2.length", 0.31}};
  const Model planted = Shipped("pendulum2_planar", {}, truth);
  const Model start = Shipped("pendulum2_planar");
  const auto free =
      FreeFrom(start, {{"link1.length", 0.5}, {"link2.length", 0.4}});
  Calibration calibration;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    SimulationOptions options;
    options.duration = 5.0;
    options.noise = 1e-3;
    options.seed = seed;
    const Fit fit =
        FitRuns(start, free,
                {Simulate(planted, RandomState(planted, 0.8, seed), options)});
    Add(fit, truth, seed, &calibration);
  }
  ExpectCalibrated(calibration);
}

TEST(Calibration, OfACartpoleUnderEffort) {
  const std::vector<Value> truth = {
      {"cart.mass", 1.3}, {"pole.mass", 0.25}, {"pole.length", 0.5}};
  const Model planted = Shipped("cartpole", {}, truth);
  const Model start = Shipped("cartpole");
  const auto free = FreeFrom(
      start, {{"cart.mass", 1.0}, {"pole.mass", 0.2}, {"pole.length", 0.6}});
  Calibration calibration;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    SimulationOptions options;
    options.duration = 5.0;
    options.noise = 1e-3;
    options.seed = seed;
    options.excitation = Excitation::kMultisine;
    const Fit fit =
        FitRuns(start, free,
                {Simulate(planted, RandomState(planted, 0.3, seed), options)});
    Add(fit, truth, seed, &calibration);
  }
  ExpectCalibrated(calibration);
}

}  // namespace
}  // namespace sysid
