#include "sysid/estimation/shooting_problem.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/step_size.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

using Eigen::VectorXd;
using ::testing::ElementsAre;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// --- CutRun -----------------------------------------------------------------

std::vector<double> Samples(int count, double period) {
  std::vector<double> t;
  for (int k = 0; k < count; ++k) t.push_back(3.0 + k * period);
  return t;
}

TEST(CutRun, CutsEvenlyIntoAboutTheLength) {
  EXPECT_THAT(CutRun(Samples(101, 0.01), 0.25, 5),
              ElementsAre(0, 25, 50, 75, 100));
  EXPECT_THAT(CutRun(Samples(101, 0.01), 0.33, 5), ElementsAre(0, 33, 67, 100));
}

TEST(CutRun, KeepsOneSegmentOfAShortRun) {
  EXPECT_THAT(CutRun(Samples(11, 0.01), 1.0, 5), ElementsAre(0, 10));
  EXPECT_THAT(CutRun(Samples(10, 0.01), 0.01, 5), ElementsAre(0, 9));
  EXPECT_THAT(CutRun(Samples(1001, 0.01), kInfinity, 5), ElementsAre(0, 1000));
}

TEST(CutRun, LeavesEverySegmentItsFewestSamples) {
  for (int count = 2; count < 60; ++count) {
    for (const int min_samples : {1, 3, 7}) {
      const std::vector<int> samples =
          CutRun(Samples(count, 0.04), 0.1, min_samples);
      ASSERT_GE(samples.size(), 2u);
      EXPECT_EQ(samples.front(), 0);
      EXPECT_EQ(samples.back(), count - 1);
      int least = count, most = 0;
      for (size_t k = 1; k < samples.size(); ++k) {
        least = std::min(least, samples[k] - samples[k - 1]);
        most = std::max(most, samples[k] - samples[k - 1]);
      }
      if (samples.size() > 2) {
        EXPECT_GE(least, min_samples);
      }
      EXPECT_LE(most - least, 1);
    }
  }
}

// --- Noise ------------------------------------------------------------------

Run PlanarRun(double noise, int seed, double duration = 5.0) {
  const Model model = Shipped("pendulum2_planar");
  SimulationOptions options;
  options.duration = duration;
  options.noise = noise;
  options.seed = seed;
  return Simulate(model, RandomState(model, 0.5, seed), options);
}

TEST(ShootingProblem, EstimatesTheNoiseOfEachChannel) {
  const Model model = Shipped("pendulum2_planar");
  const ShootingProblem problem(model, {}, {PlanarRun(2e-3, 1, 10.0)}, {});
  for (const double sigma : problem.runs()[0]->sigma) {
    EXPECT_NEAR(sigma, 2e-3, 0.15 * 2e-3);
  }
  EXPECT_NEAR(problem.data().PooledNoise(), 2e-3, 0.1 * 2e-3);
}

TEST(ShootingProblem, EstimatesTheNoiseOfSphericalJoints) {
  const Model model = Shipped("pendulum2");
  SimulationOptions options;
  options.noise = 2e-3;
  const sysid::Run run = Simulate(model, RandomState(model, 0.5, 1), options);
  for (const auto residual :
       {OrientationResidual::kHeading, OrientationResidual::kRotation}) {
    EstimationOptions estimation;
    estimation.orientation = residual;
    const ShootingProblem problem(model, {}, {run}, estimation);
    EXPECT_NEAR(problem.data().PooledNoise(), 2e-3, 0.1 * 2e-3);
  }
}

TEST(ShootingProblem, TakesTheNoiseThatIsGiven) {
  EstimationOptions options;
  options.noise = 0.5;
  const ShootingProblem problem(Shipped("pendulum2_planar"), {},
                                {PlanarRun(2e-3, 1)}, options);
  EXPECT_THAT(problem.runs()[0]->sigma, ElementsAre(0.5, 0.5));
}

TEST(ShootingProblem, PoolsTheNoiseOfASensorOverTheRuns) {
  const ShootingProblem problem(Shipped("pendulum2_planar"), {},
                                {PlanarRun(1e-3, 1), PlanarRun(3e-3, 2)}, {});
  EXPECT_EQ(problem.runs()[0]->sigma, problem.runs()[1]->sigma);
  EXPECT_NEAR(problem.data().PooledNoise(), std::sqrt(5.0) * 1e-3, 0.2e-3);
}

TEST(ShootingProblem, SharesItsDataWithWhatIsMadeOfIt) {
  const Model model = Shipped("pendulum1");
  const ShootingProblem problem(
      model, FreeFrom(model, {{"link1.length", 0.4}}),
      {Simulate(model, RandomState(model, 0.5, 1), {})}, EstimationOptions());
  const ShootingProblem other =
      Changed(problem, [](EstimationOptions* o) { o->threads = 2; });
  EXPECT_EQ(other.options().threads, 2);
  EXPECT_EQ(problem.options().threads, 1);
  EXPECT_EQ(&other.model(), &problem.model());
  const ShootingProblem trial(model, {}, problem.shared_data(),
                              problem.options());
  EXPECT_EQ(trial.runs()[0].get(), problem.runs()[0].get());
}

TEST(MakeDataSet, TakesTheNoiseOfAnotherForTheSameChannels) {
  const Model model = Shipped("pendulum1");
  const EstimationOptions options;
  std::vector<sysid::Run> runs;
  for (const double noise : {1e-3, 5e-3}) {
    SimulationOptions simulation;
    simulation.noise = noise;
    runs.push_back(Simulate(model, RandomState(model, 0.5, 1), simulation));
  }
  const auto quiet = MakeDataSet(model, {runs[0]}, options);
  const auto noisy = MakeDataSet(model, {runs[1]}, options);
  EXPECT_GT(noisy->PooledNoise(), 3.0 * quiet->PooledNoise());
  EXPECT_EQ(MakeDataSetLike(model, {runs[1]}, options, *quiet)->PooledNoise(),
            quiet->PooledNoise());
  // A channel that the other does not have keeps its own.
  runs[1].channels[0].name = "another";
  EXPECT_EQ(MakeDataSetLike(model, {runs[1]}, options, *quiet)->PooledNoise(),
            noisy->PooledNoise());
}

TEST(ShootingProblem, SeesThroughTheWrapOfAnAngle) {
  sysid::Run run = PlanarRun(1e-3, 1, 10.0);
  for (double& angle : run.channels[0].values.reshaped()) {
    angle = std::remainder(angle + 3.0, 2 * M_PI);
  }
  const ShootingProblem problem(Shipped("pendulum2_planar"), {}, {run}, {});
  EXPECT_NEAR(problem.runs()[0]->sigma[0], 1e-3, 0.15e-3);
}

TEST(ShootingProblem, CountsWhatASampleMeasures) {
  sysid::Run run = PlanarRun(1e-3, 1);
  run.channels[0].values.topRows(run.size() / 2).setConstant(kNaN);
  const ShootingProblem problem(Shipped("pendulum2_planar"), {}, {run}, {});
  EXPECT_NEAR(problem.data().DofPerSample(), 1.5, 0.01);
  EXPECT_NEAR(problem.data().MedianSamplePeriod(), 0.01, 1e-12);
  EXPECT_NEAR(problem.data().LongestDuration(), 5.0, 1e-12);
}

// --- SampleStates and ChooseRollout ------------------------------------------

Solution PointOf(const ShootingProblem& problem, double length) {
  std::vector<RowMatrixXd> states;
  for (size_t r = 0; r < problem.runs().size(); ++r) {
    states.push_back(StatesFromData(problem, static_cast<int>(r)));
  }
  return CutPoint(problem, problem.InitialTheta(), states, length);
}

TEST(SampleStates, PassThroughTheNodesAndFollowTheModelBetween) {
  const sysid::Run run = PlanarRun(1e-3, 1);
  const ShootingProblem problem(Shipped("pendulum2_planar"), {}, {run}, {});
  const Solution point = PointOf(problem, 0.5);
  RowMatrixXd states;
  ASSERT_TRUE(SampleStates(problem, point, 0, &states));
  ASSERT_EQ(states.rows(), run.size());
  for (int k = 0; k < point.runs[0].segments(); ++k) {
    EXPECT_EQ(states.row(point.runs[0].samples[k]),
              point.runs[0].states.row(k));
  }
  // From the data's states the model is near the data.
  for (int k = 0; k < run.size(); ++k) {
    EXPECT_NEAR(states(k, 0), run.channels[0].values(k, 0), 0.03);
  }
}

double StepFor(const Model& model, const Run& run, double noise) {
  EstimationOptions options;
  options.noise = noise;
  const ShootingProblem problem(model, {}, {run}, options);
  return ChooseRollout(problem, PointOf(problem, 0.5), 0.2).step;
}

TEST(ChooseRollout, TakesTheSamplePeriodWhereThatDoes) {
  EXPECT_NEAR(StepFor(Shipped("pendulum2_planar"), PlanarRun(1e-3, 1), 1e-3),
              0.01, 1e-12);
}

TEST(ChooseRollout, IsFinerForAStiffFriction) {
  const Model model = Shipped("pendulum1", {"coulomb_friction@joint1"},
                              {{"joint1.friction", 0.5}});
  SimulationOptions options;
  options.duration = 3.0;
  options.noise = 1e-4;
  const sysid::Run run = Simulate(model, RandomState(model, 1.0, 1), options);
  const double step = StepFor(model, run, 1e-4);
  EXPECT_LT(step, 0.006);
  EXPECT_GT(step, 0.01 / 65);
}

// A link with hardly any inertia about its axis: 1.5 N m s/rad stop its spin
// within 50 us, and no longer step of Runge and Kutta's is stable.
TEST(ChooseRollout, IsStableForADampedSpin) {
  const Model model = Shipped("pendulum1", {"viscous_damping@joint1"},
                              {{"joint1.damping", 1.5}});
  SimulationOptions simulation;
  simulation.duration = 2.0;
  simulation.noise = 1e-3;
  simulation.step = 2e-5;
  const sysid::Run run =
      Simulate(model, RandomState(model, 1.0, 1), simulation);
  EstimationOptions options;
  options.noise = 1e-3;
  for (const bool may_change : {false, true}) {
    options.rollout.may_change = may_change;
    const ShootingProblem problem(model, {}, {run}, options);
    Solution point = PointOf(problem, 0.5);
    point.rollout = ChooseRollout(problem, point, 0.2);
    EXPECT_EQ(point.rollout.integrator,
              may_change ? Integrator::kRosenbrock2 : Integrator::kRungeKutta4);
    EXPECT_EQ(point.rollout.step > 0.01 / 64, may_change);
    EXPECT_LT(EvaluateErrors(problem, point, 0.0).total.normalized_rms, 30.0);
  }
}

TEST(ChooseRollout, IsFinerWhereTheNoiseIsSmaller) {
  const sysid::Run run = PlanarRun(0.0, 3);
  const Model model = Shipped("pendulum2_planar");
  EXPECT_LT(StepFor(model, run, 1e-9), StepFor(model, run, 1e-3));
}

TEST(ChooseRollout, MindsTheIntegrator) {
  EstimationOptions options;
  options.noise = 1e-4;
  options.rollout.integrator = Integrator::kSemiImplicitEuler;
  const ShootingProblem problem(Shipped("pendulum2_planar"), {},
                                {PlanarRun(1e-4, 1)}, options);
  const RolloutOptions chosen =
      ChooseRollout(problem, PointOf(problem, 0.5), 0.2);
  EXPECT_EQ(chosen.integrator, Integrator::kSemiImplicitEuler);
  EXPECT_LT(chosen.step, 0.006);
}

}  // namespace
}  // namespace sysid
