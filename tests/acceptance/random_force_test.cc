#include "tests/support/random_force.h"

#include <gtest/gtest.h>

#include "sysid/diagnosis/diagnose.h"
#include "sysid/unexplained_force/discrepancy.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"

// What is said of a machine on which a force acts that no law describes.

namespace sysid {
namespace {

TEST(RandomForce, LeavesIntervalsThatHoldTheTruth) {
  constexpr int kSeeds = 12;
  constexpr struct {
    double std, correlation_s;
  } kForces[] = {{0.02, 0.3}, {0.1, 0.05}, {0.1, 0.3}, {0.1, 1.0}, {0.3, 0.3}};
  const Model model = ForcedPendulum();
  const std::vector<Value> truth = TruthOfForcedPendulum();
  int held = 0, all = 0;
  for (const auto& force : kForces) {
    for (int seed = 1; seed <= kSeeds; ++seed) {
      const ShootingProblem problem(
          model, FreeFrom(model, truth),
          {RecordUnderRandomForce({force.std, force.correlation_s, seed})},
          EstimationOptions{});
      Fit fit = FitLevenbergMarquardt(problem);
      if (!fit.converged) continue;
      AddDiscrepancy(problem, &fit);
      for (const Value& value : truth) {
        const ParameterEstimate& estimate = EstimateOf(fit, value.name);
        if (!std::isfinite(estimate.std_error)) continue;
        ++all;
        held +=
            estimate.ci95[0] <= value.value && value.value <= estimate.ci95[1];
      }
    }
  }
  // 95 % of 240, within three standard deviations of their number.
  EXPECT_GT(all, 220);
  EXPECT_GE(held, 0.90 * all) << held << " of " << all;
  EXPECT_LE(held, 0.99 * all) << held << " of " << all;
}

TEST(RandomForce, IsNotTakenForAnEffect) {
  constexpr int kSeeds = 12;
  const Model model = ForcedPendulum();
  int named = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    sysid::Run run = RecordUnderRandomForce(
        {.std = 0.1, .correlation_s = 0.3, .seed = seed});
    sysid::Run other = RecordUnderRandomForce(
        {.std = 0.1, .correlation_s = 0.3, .seed = kSeeds + seed});
    DiagnosisProblem problem =
        MakeProblem(model, TruthOfForcedPendulum(), {other, run});
    problem.options.threads = 2;
    std::vector<std::shared_ptr<const Effect>> candidates;
    for (const auto& effect : AllCandidates(model)) {
      if (effect->kind() != "viscous_damping") candidates.push_back(effect);
    }
    const Diagnosis diagnosis = Diagnose(problem, candidates, {.add = false});
    named += diagnosis.verdict != Verdict::kUnexplained;
  }
  EXPECT_LE(named, 1) << "of " << kSeeds;
}

}  // namespace
}  // namespace sysid
