#include "sysid/estimation/segmentation.h"

#include <gtest/gtest.h>

#include "models/state.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

// The length of the segments of a swing from `q`, known but for its noise.
double LengthOf(const Model& model, const std::vector<double>& q,
                Drift allowed) {
  Eigen::VectorXd x = NeutralState(model);
  for (size_t i = 0; i < q.size(); ++i) x[i] = q[i];
  SimulationOptions simulation;
  simulation.duration = 20.0;
  simulation.noise = 1e-4;
  const ShootingProblem problem(model, FreeFrom(model, {{"link1.length", 0.5}}),
                                {Simulate(model, x, simulation)},
                                EstimationOptions{});
  return ChooseSegment(problem, ShortSegments(problem), allowed);
}

// The period of a wide swing depends on its width: neighbours drift apart
// fourfold within one swing, but no faster than linearly.
TEST(ChooseSegment, IsLongForWideRegularSwings) {
  for (const double q : {0.3, 1.0, 1.6}) {
    EXPECT_DOUBLE_EQ(LengthOf(Shipped("video_pendulum"), {q}, Drift::kLinear),
                     kLongestLength)
        << q;
  }
}

TEST(ChooseSegment, IsShorterWhereNeighboursMayDriftLittle) {
  const Model model = Shipped("video_pendulum");
  EXPECT_DOUBLE_EQ(LengthOf(model, {0.3}, Drift::kLittle), kLongestLength);
  EXPECT_LE(LengthOf(model, {2.6}, Drift::kLittle), kLongestLength / 2);
}

TEST(ChooseSegment, IsShortForChaos) {
  EXPECT_LT(LengthOf(Shipped("pendulum2_planar"), {2.5, 1.0}, Drift::kLinear),
            kLongestLength / 2);
}

// 20 s of a swing with friction: from good parameters, in long segments.
TEST(FitLevenbergMarquardtFrom, GoesOnFromLongSegments) {
  const std::vector<Value> truth = {{"link1.length", 0.5},
                                    {"joint1.damping", 0.004}};
  const Model model = Shipped("pendulum2_planar", {"viscous_damping@joint1"});
  Model planted = model;
  Set({{"joint1.damping", 0.004}}, &planted);
  Eigen::VectorXd x = NeutralState(model);
  x[0] = 0.5;
  x[1] = 0.2;
  SimulationOptions simulation;
  simulation.duration = 20.0;
  simulation.noise = 1e-4;
  const sysid::Run run = Simulate(planted, x, simulation);
  const ShootingProblem near(
      model,
      FreeFrom(model, {{"link1.length", 0.5002}, {"joint1.damping", 0.004}}),
      {run}, EstimationOptions{});
  const Fit fit = FitLevenbergMarquardtFrom(near, 5.0);
  const Fit usual = FitLevenbergMarquardt(near);
  EXPECT_TRUE(fit.converged) << fit.termination;
  EXPECT_LT(fit.train.total.normalized_rms, 1.1);
  for (const Value& value : truth) {
    EXPECT_LT(std::abs(Deviation(fit, value)), 4.0) << value.name;
    EXPECT_NEAR(EstimateOf(fit, value.name).value,
                EstimateOf(usual, value.name).value,
                0.1 * EstimateOf(usual, value.name).std_error)
        << value.name;
  }
}

}  // namespace
}  // namespace sysid
