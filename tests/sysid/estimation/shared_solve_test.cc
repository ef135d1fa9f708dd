#include "sysid/estimation/shared_solve.h"

#include <gmock/gmock.h>

#include <cmath>
#include <mutex>

#include "sysid/estimation/fit.h"
#include "sysid/estimation/segmentation.h"
#include "tests/support/fit_setup.h"
#include "tests/support/thread_processes.h"

namespace sysid {
namespace {

// Runs of a planar double pendulum that rubs, one of them longer than all
// others together, and starts that are off.
struct ManyRuns {
  ManyRuns()
      : model(Shipped("pendulum2_planar", {"viscous_damping@joint1"},
                      {{"joint1.damping", 0.02}})) {
    SimulationOptions simulation;
    simulation.noise = 1e-3;
    for (const double duration : {1.0, 0.7, 6.0, 1.3, 0.6}) {
      simulation.duration = duration;
      simulation.seed = runs.size() + 1;
      runs.push_back(Simulate(model, RandomState(model, 0.5, 1 + runs.size()),
                              simulation));
      runs.back().name = "run" + std::to_string(runs.size());
    }
    free = FreeFrom(model, {{"link1.length", 0.4}, {"joint1.damping", 0.0}});
    free[0].prior = FreeParameter::Prior{0.5, 0.1};
  }
  // By so many processes, each with these runs; of the first one.
  Fit With(const std::vector<std::vector<int>>& shares) const {
    Fit first(model);
    std::mutex mutex;
    ThreadProcesses(static_cast<int>(shares.size()))
        .Run([&](const Processes& all) {
          const SharedPart own(all, runs, shares);
          const Fit fit = FitLevenbergMarquardt(
              ShootingProblem(model, free, own.runs, own.options));
          if (all.rank() > 0) return;
          const std::lock_guard lock(mutex);
          first = fit;
        });
    return first;
  }

  Model model;
  std::vector<Run> runs;
  std::vector<FreeParameter> free;
};

void ExpectSame(const Fit& fit, const Fit& other, double std_errors) {
  EXPECT_TRUE(fit.converged) << fit.termination;
  EXPECT_EQ(fit.iterations, other.iterations);
  EXPECT_EQ(fit.samples, other.samples);
  EXPECT_EQ(fit.step_s, other.step_s);
  EXPECT_NEAR(fit.noise, other.noise, 1e-14 * other.noise);
  ASSERT_EQ(fit.parameters.size(), other.parameters.size());
  for (size_t i = 0; i < fit.parameters.size(); ++i) {
    const ParameterEstimate& p = other.parameters[i];
    EXPECT_NEAR(fit.parameters[i].value, p.value, std_errors * p.std_error);
    EXPECT_NEAR(fit.parameters[i].std_error, p.std_error, 1e-8 * p.std_error);
  }
  EXPECT_NEAR(fit.train.total.normalized_rms, other.train.total.normalized_rms,
              1e-9);
  ASSERT_EQ(fit.horizon.size(), other.horizon.size());
  for (size_t h = 0; h < fit.horizon.size(); ++h) {
    EXPECT_NEAR(fit.horizon[h].rms, other.horizon[h].rms,
                1e-6 * other.horizon[h].rms);
  }
}

TEST(SolveOverProcesses, IsTheFitOfOneProcessByCeres) {
  const ManyRuns setup;
  const Fit alone = FitLevenbergMarquardt(ShootingProblem(
      setup.model, setup.free, setup.runs, EstimationOptions()));
  const Fit one = setup.With({{0, 1, 2, 3, 4}});
  ExpectSame(one, alone, 1e-9);
}

TEST(SolveOverProcesses, DoesNotDependOnTheProcesses) {
  const ManyRuns setup;
  const Fit one = setup.With({{0, 1, 2, 3, 4}});
  for (const std::vector<std::vector<int>>& shares :
       {std::vector<std::vector<int>>{{0, 1}, {2}, {3, 4}},
        {{0}, {1}, {2}, {3}, {4}},
        {{}, {0, 1, 2, 3, 4}, {}},
        {{0, 1, 2, 3}, {4}, {}}}) {
    ExpectSame(setup.With(shares), one, 1e-9);
  }
}

TEST(SolveOverProcesses, FindsStatesWhereNothingIsFree) {
  ManyRuns setup;
  setup.free.clear();
  const Fit one = setup.With({{0, 1, 2, 3, 4}});
  const Fit three = setup.With({{0, 1}, {2}, {3, 4}});
  EXPECT_NEAR(three.train.total.normalized_rms, one.train.total.normalized_rms,
              1e-9);
  EXPECT_EQ(three.iterations, one.iterations);
}

TEST(SolveOverProcesses, HoldsParametersAtTheirBounds) {
  ManyRuns setup;
  setup.free[0].prior.reset();
  setup.free[0].lower = 0.52;  // the truth is 0.5
  setup.free[0].initial = 0.6;
  const Fit alone = FitLevenbergMarquardt(ShootingProblem(
      setup.model, setup.free, setup.runs, EstimationOptions()));
  const Fit three = setup.With({{0, 1}, {2}, {3, 4}});
  EXPECT_TRUE(three.parameters[0].at_bound);
  EXPECT_EQ(three.iterations, alone.iterations);
  EXPECT_NEAR(three.parameters[1].value, alone.parameters[1].value,
              1e-7 * alone.parameters[1].std_error);
}

}  // namespace
}  // namespace sysid
