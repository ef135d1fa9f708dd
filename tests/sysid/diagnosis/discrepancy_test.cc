#include "sysid/diagnosis/discrepancy.h"

#include <gtest/gtest.h>

#include "tests/support/random_force.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

ShootingProblem ForcedProblem(const RandomForceCase& c, double segment = 0.0) {
  EstimationOptions options;
  options.noise = 1e-3;
  options.segment = segment;
  const Model model = ForcedPendulum();
  return ShootingProblem(model, FreeFrom(model, TruthOfForcedPendulum()),
                         {RecordUnderRandomForce(c)}, options);
}

TEST(Discrepancy, FindsTheSizeOfARandomForce) {
  const ShootingProblem problem = ForcedProblem({});
  Fit fit = FitLevenbergMarquardt(problem);
  ASSERT_TRUE(fit.converged);
  const std::vector<ParameterEstimate> before = fit.parameters;
  AddDiscrepancy(problem, &fit);
  ASSERT_EQ(fit.discrepancy.size(), 2u);
  EXPECT_EQ(fit.discrepancy[0].joint, "joint1");
  // One path of a force tells its size roughly.
  EXPECT_GT(fit.discrepancy[0].force_std, 0.1 / 3);
  EXPECT_LT(fit.discrepancy[0].force_std, 0.1 * 3);
  EXPECT_LT(fit.discrepancy[1].force_std, fit.discrepancy[0].force_std);
  EXPECT_GT(fit.discrepancy[0].correlation_time_s, 0.05);
  EXPECT_LT(fit.discrepancy[0].correlation_time_s, 1.0);
  // The values stay, the intervals do not.
  for (size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(fit.parameters[i].value, before[i].value);
    EXPECT_GT(fit.parameters[i].std_error, before[i].std_error);
  }
}

TEST(Discrepancy, DoesNotHangOnHowTheRunIsCut) {
  const ShootingProblem a = ForcedProblem({}, 1.25), b = ForcedProblem({}, 5.0);
  Fit fit_a = FitLevenbergMarquardt(a), fit_b = FitLevenbergMarquardt(b);
  AddDiscrepancy(a, &fit_a);
  AddDiscrepancy(b, &fit_b);
  for (size_t i = 0; i < fit_a.parameters.size(); ++i) {
    EXPECT_NEAR(fit_a.parameters[i].std_error / fit_b.parameters[i].std_error,
                1.0, 0.3)
        << fit_a.parameters[i].name;
  }
}

TEST(Discrepancy, LeavesAFitAtTheNoiseAsItIs) {
  const ShootingProblem problem = ForcedProblem({.std = 0.0});
  Fit fit = FitLevenbergMarquardt(problem);
  const double before = fit.parameters[0].std_error;
  AddDiscrepancy(problem, &fit);
  EXPECT_TRUE(fit.discrepancy.empty());
  EXPECT_EQ(fit.parameters[0].std_error, before);
}

TEST(Discrepancy, WidensIndependentSegmentsToo) {
  const ShootingProblem problem = ForcedProblem({}, 1.25);
  Fit fit = FitIndependentSegments(problem);
  const std::vector<ParameterEstimate> before = fit.parameters;
  AddDiscrepancy(problem, &fit);
  ASSERT_FALSE(fit.discrepancy.empty());
  for (size_t i = 0; i < before.size(); ++i) {
    EXPECT_TRUE(std::isfinite(fit.parameters[i].std_error));
    EXPECT_GT(fit.parameters[i].std_error, 0.3 * before[i].std_error);
  }
}

TEST(Discrepancy, TestsEffectsBesideIt) {
  const ShootingProblem problem = ForcedProblem({});
  Fit fit = FitLevenbergMarquardt(problem);
  AddDiscrepancy(problem, &fit);
  const Catalogue catalogue;
  const Model none = Shipped("pendulum2_planar");
  const auto damping =
      catalogue.Make("viscous_damping@joint1", none.mechanism(), "test");
  EXPECT_LT(PValueOf(*damping, none, fit), 0.01);
}

}  // namespace
}  // namespace sysid
