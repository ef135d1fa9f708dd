#include "sysid/stochastic/comparison.h"

#include <gmock/gmock.h>

#include <cmath>
#include <stop_token>

#include "tests/sysid/stochastic/stochastic_setup.h"

namespace sysid {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

ComparisonOptions Options(int repeat = 1) {
  ComparisonOptions options;
  options.adam.from_rest = options.mixture.from_rest = true;
  options.truth = Eigen::Vector2d(0.4, 0.3);
  options.repeat = repeat;
  return options;
}

TEST(CompareSolvers, MeasuresAllFromTheSameStartByTheSameLoss) {
  const auto problem = TwoLengths();
  const Comparison comparison = CompareSolvers(*problem, Options());
  ASSERT_EQ(comparison.runs.size(), 3u);
  const std::vector<std::string> names{"lm", "adam", "gmm"};
  for (int s = 0; s < 3; ++s) {
    const SolverRun& run = comparison.runs[s];
    EXPECT_EQ(run.solver, names[s]);
    EXPECT_TRUE(run.fit.converged) << run.fit.termination;
    EXPECT_LT(run.distance, 0.02) << run.solver;
    EXPECT_GE(run.path.size(), 2u);
    EXPECT_LT(run.path.back().loss, 1e-2 * run.path.front().loss);
    EXPECT_GT(run.fit.evaluations, 0);
    EXPECT_LE(run.settled, run.fit.iterations);
    for (size_t i = 1; i < run.path.size(); ++i) {
      EXPECT_GE(run.path[i].time_s, run.path[i - 1].time_s);
    }
    // The estimates take time too.
    const double seconds = comparison.trials[0].solvers[s].time_s;
    EXPECT_EQ(seconds, run.fit.wall_time_s);
    EXPECT_GT(seconds, run.path.back().time_s);
    for (int i = 0; i < 2; ++i) {
      EXPECT_NEAR(run.path.back().values[i], run.fit.parameters[i].value,
                  1e-3 * run.fit.parameters[i].value);
    }
  }
  // The mixture starts about the others' start.
  EXPECT_EQ(comparison.runs[0].path.front().values, Eigen::Vector2d(0.5, 0.5));
  EXPECT_EQ(comparison.runs[1].path.front().values, Eigen::Vector2d(0.5, 0.5));
  EXPECT_EQ(comparison.runs[0].path.front().loss,
            comparison.runs[1].path.front().loss);
  EXPECT_LT(comparison.runs[0].settled, comparison.runs[1].settled);
  EXPECT_TRUE(comparison.reference_is_truth);
  ASSERT_EQ(comparison.uncertainty.size(), 2u);
  EXPECT_GT(comparison.uncertainty[0].lm_std, 0.0);
  EXPECT_GT(comparison.uncertainty[0].mixture_std, 0.0);
  EXPECT_NE(comparison.uncertainty[0].why, "");
}

// Where a solver's steps are implicit in the damping, so is the measure: Runge
// and Kutta's of that length would be unstable.
TEST(CompareSolvers, MeasuresStiffDampingByStepsThatFollowIt) {
  const std::vector<std::string> effects{"viscous_damping@joint1"};
  const Model truth = Shipped("pendulum1", effects, {{"joint1.damping", 1.5}});
  const Model model = Shipped("pendulum1", effects);
  SimulationOptions recording;
  recording.duration = 0.5;
  recording.noise = 1e-3;
  recording.step = 2e-5;
  EstimationOptions estimation;
  estimation.noise = 1e-3;
  const ShootingProblem problem(
      model, FreeFrom(model, {{"joint1.damping", 1.0}}),
      {Simulate(truth, RandomState(truth, 1.0, 1), recording)}, estimation);
  ComparisonOptions options = Options();
  options.adam.from_rest = options.mixture.from_rest = false;
  options.truth = Eigen::VectorXd::Constant(1, 1.5);
  const Comparison comparison = CompareSolvers(problem, options);
  EXPECT_EQ(comparison.rollout.integrator, Integrator::kRosenbrock2);
  for (const SolverRun& run : comparison.runs) {
    EXPECT_TRUE(std::isfinite(run.path.back().loss)) << run.solver;
    EXPECT_LT(run.path.back().loss, run.path.front().loss) << run.solver;
  }
}

TEST(CompareSolvers, PutsTheLikelihoodOfTwoParametersOnAGrid) {
  const auto problem = TwoLengths();
  const Comparison comparison = CompareSolvers(*problem, Options());
  ASSERT_TRUE(comparison.landscape.has_value());
  const Landscape& landscape = *comparison.landscape;
  int row = 0, column = 0;
  EXPECT_GE(landscape.deviance.minCoeff(&row, &column), 0.0);
  EXPECT_NEAR(landscape.x[column], 0.4, 0.02);
  EXPECT_NEAR(landscape.y[row], 0.3, 0.02);
}

TEST(CompareSolvers, RepeatsFromOtherStarts) {
  const auto problem = TwoLengths();
  const Comparison comparison = CompareSolvers(*problem, Options(3));
  ASSERT_EQ(comparison.trials.size(), 3u);
  EXPECT_EQ(comparison.trials[0].start, Eigen::Vector2d(0.5, 0.5));
  EXPECT_NE(comparison.trials[1].start, comparison.trials[2].start);
  for (const ComparedStart& trial : comparison.trials) {
    for (const SolverTrial& solver : trial.solvers) {
      EXPECT_TRUE(solver.converged);
      EXPECT_LT(solver.distance, 0.02);
    }
  }
}

TEST(CompareSolvers, KeepsTheStartsThatWereDoneWhereItIsInterrupted) {
  // In the second start: the first solver's second beginning.
  const auto problem = TwoLengths();
  std::stop_source source;
  bool mixture = false;
  *problem = Changed(*problem, [&](EstimationOptions* o) {
    o->stop = source.get_token();
    o->keep_best = true;
    o->progress = [&](const Progress& progress) {
      mixture = mixture || progress.doing == "gmm";
      if (mixture && progress.doing != "gmm") source.request_stop();
    };
  });
  const Comparison comparison = CompareSolvers(*problem, Options(3));
  EXPECT_EQ(comparison.asked, 3);
  ASSERT_EQ(comparison.trials.size(), 1u);
  for (const SolverTrial& solver : comparison.trials[0].solvers) {
    EXPECT_TRUE(solver.converged);
  }
}

TEST(CompareSolvers, HasAPointOfEachSolverWhereTheFirstIsInterrupted) {
  const auto problem = TwoLengths();
  std::stop_source source;
  *problem = Changed(*problem, [&](EstimationOptions* o) {
    o->stop = source.get_token();
    o->keep_best = true;
    o->progress = [&](const Progress& progress) {
      if (progress.iteration == 2) source.request_stop();
    };
  });
  const Comparison comparison = CompareSolvers(*problem, Options(1));
  ASSERT_EQ(comparison.runs.size(), 3u);
  for (const SolverRun& run : comparison.runs) {
    EXPECT_FALSE(run.fit.converged);
    EXPECT_THAT(run.fit.termination, HasSubstr("interrupted after"));
    EXPECT_GE(run.fit.iterations, 1);
  }
}

TEST(CompareSolvers, TakesLevenbergMarquardtForTheReferenceWithoutATruth) {
  const auto problem = TwoLengths();
  ComparisonOptions options = Options();
  options.truth.reset();
  const Comparison comparison = CompareSolvers(*problem, options);
  EXPECT_FALSE(comparison.reference_is_truth);
  EXPECT_EQ(comparison.runs[0].distance, 0.0);
  EXPECT_GT(comparison.runs[1].distance, 0.0);
}

TEST(CompareSolvers, TakesNoReferenceFromWhatLevenbergMarquardtLeavesOpen) {
  const auto problem = RodAndBob();
  ComparisonOptions options = Options();
  options.truth.reset();
  const Comparison comparison = CompareSolvers(*problem, options);
  EXPECT_TRUE(comparison.reference.array().isNaN().all());
  for (const SolverRun& run : comparison.runs) {
    EXPECT_TRUE(std::isnan(run.distance));
    EXPECT_EQ(run.farthest, "");
  }
  EXPECT_TRUE(comparison.landscape->deviance.allFinite());
}

// Adam has no slope at a damping of null, so none starts there.
TEST(CompareSolvers, StartsAllOffTheBounds) {
  const auto problem = TwoDampings({{"joint1.damping", 0.0}}, 0.4);
  ComparisonOptions options = Options();
  options.truth.reset();
  options.adam.adam.epochs = options.mixture.adam.epochs = 5;
  const Comparison comparison = CompareSolvers(*problem, options);
  EXPECT_GT(comparison.start[0], 0.0);
  for (const SolverRun& run : comparison.runs) {
    EXPECT_EQ(run.fit.parameters[0].initial, comparison.start[0]) << run.solver;
  }
}

// With a wide start and few epochs a mixture may end wider than it began.
TEST(CompareSolvers, SaysWhereTheMixtureWidened) {
  const auto problem =
      TwoDampings({{"joint1.damping", 0.0}, {"joint2.damping", 0.0}}, 0.4);
  ComparisonOptions options = Options();
  options.truth.reset();
  options.mixture.adam.epochs = 10;
  const Comparison comparison = CompareSolvers(*problem, options);
  const ParameterMixture& first =
      comparison.runs[2].mixture->epochs.front().kernels;
  ASSERT_GT(comparison.uncertainty[0].mixture_std, first.Std()[0]);
  EXPECT_THAT(comparison.uncertainty[0].why,
              AllOf(HasSubstr("widened"), Not(HasSubstr("narrowed"))));
}

TEST(CompareSolvers, SaysWhyUncertaintiesOfCoupledParametersDiffer) {
  const auto problem = RodAndBob();
  ComparisonOptions options = Options();
  options.truth = Eigen::Vector2d(0.6, -0.15);
  const Comparison comparison = CompareSolvers(*problem, options);
  for (const UncertaintyComparison& u : comparison.uncertainty) {
    EXPECT_TRUE(std::isnan(u.lm_std));
    EXPECT_THAT(u.why, HasSubstr("not identifiable from this data"));
  }
  // One down as the other goes up: rod.length - bob.com_z stays.
  const Eigen::Vector2d valley = comparison.landscape->valley;
  EXPECT_NEAR(valley[0], valley[1], 1e-3);
}

}  // namespace
}  // namespace sysid
