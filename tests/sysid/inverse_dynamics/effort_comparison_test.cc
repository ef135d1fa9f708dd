#include "sysid/inverse_dynamics/effort_comparison.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sysid/inverse_dynamics/two_links.h"

namespace sysid {
namespace {

TEST(CompareEfforts, LeavesNothingOfATrueModel) {
  const Model truth = FrictionArm(0.0);
  const ShootingProblem problem(truth, FreeNominal(truth, {"link2.mass"}),
                                {Shaken(truth, 1e-5, 1)}, {});
  const EffortComparison found =
      CompareEfforts(problem, problem.InitialTheta());
  ASSERT_EQ(found.errors.size(), 2u);
  ASSERT_EQ(found.series.size(), 2u);
  EXPECT_GT(found.cut_off_hz, 1.0);
  for (int j = 0; j < 2; ++j) {
    // At the cut-off the equations explain half of what there is.
    EXPECT_LT(found.errors[j].percent, 5.0) << found.errors[j].joint;
    const EffortSeries& series = found.series[j];
    EXPECT_EQ(series.joint, found.errors[j].joint);
    EXPECT_EQ(series.unit, "N m");
    ASSERT_EQ(series.t.size(), series.predicted.size());
    double left = 0.0;
    int told = 0;
    for (size_t k = 0; k < series.t.size(); ++k) {
      if (!series.tells[k]) continue;
      ++told;
      left += std::pow(series.measured[k] - series.predicted[k], 2);
    }
    EXPECT_NEAR(std::sqrt(left / told), found.errors[j].rms,
                1e-12 + 1e-9 * found.errors[j].rms);
  }
}

// Half of the mass: about half of what moves the last link is left.
TEST(CompareEfforts, SaysHowMuchAWrongMassLeaves) {
  const Model truth = FrictionArm(0.0);
  const ShootingProblem problem(truth, FreeNominal(truth, {"link2.mass"}),
                                {Shaken(truth, 1e-5, 1)}, {});
  const Eigen::VectorXd half = 0.5 * problem.InitialTheta();
  const EffortComparison found = CompareEfforts(problem, half);
  EXPECT_GT(found.errors[1].percent, 20.0);
}

TEST(CompareEfforts, IsEmptyWithoutThem) {
  const Model truth = FrictionArm(0.0);
  sysid::Run free = Simulate(truth, RandomState(truth, 0.5, 1),
                             {.duration = 4.0, .rate = 100.0, .noise = 1e-4});
  const ShootingProblem still(truth, FreeNominal(truth, {"link2.mass"}), {free},
                              {});
  EXPECT_TRUE(CompareEfforts(still, still.InitialTheta()).errors.empty());
  sysid::Run blind = Shaken(truth, 1e-4, 1, 2.0);
  blind.channels.pop_back();
  const ShootingProblem unseen(truth, FreeNominal(truth, {"link2.mass"}),
                               {blind}, {});
  EXPECT_TRUE(CompareEfforts(unseen, unseen.InitialTheta()).errors.empty());
}

}  // namespace
}  // namespace sysid
