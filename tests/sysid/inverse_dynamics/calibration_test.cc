#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"
#include "tests/support/tracked_arm.h"

namespace sysid {
namespace {

// Of arm7 under a position controller, whose wrist rests for a fifth of the
// time: base parameters within their intervals as often as those say
// (tests/benchmarks/arm_coverage prints the same, by Levenberg-Marquardt too).
TEST(InverseDynamicsCalibration, OfATrackedArmOfSevenAxes) {
  constexpr int kSeeds = 40;
  constexpr double kInterval = 1.96;  // standard errors, 95 %
  int intervals = 0, hold = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    TrackedArmOptions options;
    options.seed = seed;
    const TrackedArm arm = MakeTrackedArm(options);
    const ShootingProblem problem(arm.start, arm.free, {arm.run}, {});
    const Fit fit = FitInverseDynamics(problem);
    EXPECT_TRUE(fit.converged) << "seed " << seed << ": " << fit.termination;
    const EquationCoordinates coordinates(problem.model(),
                                          problem.map().parameters());
    for (const BaseParameter& base : fit.base) {
      const double error =
          base.value - CombinationAt(base, coordinates, arm.truth);
      ++intervals;
      hold += std::abs(error) < kInterval * base.std_error;
    }
    // The wrist rests, where no law predicts its effort.
    for (int v = 0; v < 4; ++v) {
      EXPECT_LT(fit.effort[v].percent, 3.0)
          << fit.effort[v].joint << ", seed " << seed;
    }
  }
  const double coverage = double(hold) / intervals;
  std::cout << hold << " of " << intervals << " intervals hold the truth\n";
  EXPECT_GE(coverage, 0.90);
  EXPECT_LE(coverage, 0.99);
}

}  // namespace
}  // namespace sysid
