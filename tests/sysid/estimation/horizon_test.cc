#include "sysid/estimation/horizon.h"

#include <gmock/gmock.h>

#include <cmath>
#include <set>

#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

// A run of the model itself, and the trajectory that it is of.
struct True {
  True(const std::string& name, double amplitude, double noise,
       double duration = 10.0)
      : model(Shipped(name)) {
    SimulationOptions simulation;
    simulation.duration = duration;
    simulation.noise = noise;
    simulation.seed = 5;
    const Eigen::VectorXd start = RandomState(model, amplitude, 5);
    EstimationOptions options;
    options.noise = noise;
    options.rollout.step = 0.005;
    problem = std::make_unique<ShootingProblem>(
        model, std::vector<FreeParameter>(),
        std::vector<sysid::Run>{Simulate(model, start, simulation)}, options);
    Solution::Nodes nodes;
    nodes.samples = {0, problem->runs()[0]->run.size() - 1};
    nodes.states = start.transpose();
    point.theta.resize(0);
    point.rollout = options.rollout;
    point.runs.push_back(nodes);
  }
  Model model;
  std::unique_ptr<ShootingProblem> problem;
  Solution point;
};

// Where runs of 10 s begin what is followed for `horizon`, s.
std::vector<double> Begins(int runs, double horizon) {
  std::vector<double> t;
  for (int i = 0; i <= 1000; ++i) t.push_back(0.01 * i);
  std::vector<int> windows = CutRun(t, kHorizonWindow, 1);
  windows.pop_back();
  std::vector<double> begins;
  for (int run = 0; run < runs; ++run) {
    const std::vector<double> reach = HorizonReach(t, windows, {run, runs});
    for (size_t k = 0; k < reach.size(); ++k) {
      if (reach[k] >= horizon) begins.push_back(t[windows[k]]);
    }
  }
  return begins;
}

TEST(HorizonReach, TakesFewStartsOfEachOfManyRunsAndNotAllTheSame) {
  for (const double horizon : {2.0, 5.0}) {
    const size_t each = Begins(1, horizon).size();
    EXPECT_EQ(Begins(20, horizon).size(), 20 * each);
    // Those that a longer horizon follows are this one's too.
    const size_t of_100 = Begins(100, horizon).size();
    EXPECT_GE(of_100, 400u);
    EXPECT_LT(of_100, 60 * each);
    const std::vector<double> begins = Begins(1000, horizon);
    EXPECT_GE(begins.size(), 900u);
    EXPECT_LT(begins.size(), 3000u);
    // All over what has room.
    const std::set<double> places(begins.begin(), begins.end());
    EXPECT_GT(places.size(), 0.9 * (10.0 - 0.9 * horizon) / kHorizonWindow);
  }
}

// Of how many starts the error at a horizon is a mean.
int CountStarts(const std::vector<double>& t, double horizon) {
  std::vector<int> windows = CutRun(t, kHorizonWindow, 1);
  windows.pop_back();
  int count = 0;
  const std::vector<double> reach = HorizonReach(t, windows);
  for (size_t k = 0; k < reach.size(); ++k) {
    const double room = t.back() - t[windows[k]];
    count += reach[k] >= horizon && room >= 0.9 * horizon;
  }
  return count;
}

// Of a model that is true: EvaluateHorizon, which estimates its states from the
// noisy windows, and this, which never looks at them, are two roads to one
// number. Each is a mean over n states of squares whose spread is about their
// mean (in chaos more: a few states make the most of it), so that the ratio of
// two roots is within exp(3 sqrt(2 / n) / 2); twice that in chaos.
TEST(EstimateNoiseHorizon, IsWhatATrueModelReaches) {
  for (const auto& [name, amplitude, chaos] :
       {std::tuple("pendulum1", 0.5, 1.0),
        std::tuple("pendulum2_planar", 0.5, 1.0),
        std::tuple("pendulum2_planar", 2.5, 2.0),
        std::tuple("pendulum2", 0.5, 1.0)}) {
    const True truth(name, amplitude, 1e-3);
    const auto found = EvaluateHorizon(*truth.problem, truth.point);
    const auto noise = EstimateNoiseHorizon(*truth.problem, truth.point);
    ASSERT_EQ(found.size(), noise.size()) << name;
    for (size_t h = 0; h < found.size(); ++h) {
      EXPECT_EQ(found[h].horizon_s, noise[h].horizon_s);
      const int n =
          CountStarts(truth.problem->runs()[0]->run.t, found[h].horizon_s);
      ASSERT_GE(n, 5);
      EXPECT_LT(std::abs(std::log(found[h].rms / noise[h].rms)),
                std::log(chaos) + 1.5 * std::sqrt(2.0 / n))
          << name << " at " << amplitude << ", " << found[h].horizon_s
          << " s: " << found[h].rms << " and " << noise[h].rms;
    }
  }
}

// To first order twice the noise makes twice the error.
TEST(EstimateNoiseHorizon, GrowsWithTheNoise) {
  const True one("pendulum2_planar", 0.5, 1e-4);
  const True two("pendulum2_planar", 0.5, 2e-4);
  const auto a = EstimateNoiseHorizon(*one.problem, one.point);
  const auto b = EstimateNoiseHorizon(*two.problem, two.point);
  ASSERT_EQ(a.size(), b.size());
  for (size_t h = 0; h < a.size(); ++h) {
    EXPECT_NEAR(b[h].rms / a[h].rms, 2.0, 0.02) << a[h].horizon_s;
  }
}

TEST(EstimateNoiseHorizon, SaysNothingOfWhatIsLongerThanTheRun) {
  const True truth("pendulum1", 0.5, 1e-3, 1.5);
  EXPECT_EQ(EstimateNoiseHorizon(*truth.problem, truth.point).back().horizon_s,
            1.0);
}

}  // namespace
}  // namespace sysid
