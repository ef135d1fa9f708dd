#include "sysid/session/checkpoint.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <utility>

#include "tests/support/fit_setup.h"
#include "tests/support/thread_processes.h"

namespace sysid {
namespace {

// The first so many stages of a fit.
class FirstStages : public StageLog {
 public:
  std::optional<StageOutcome> Next(const std::string& doing) override {
    if (next_ >= kept.size()) return std::nullopt;
    EXPECT_EQ(kept[next_].doing, doing);
    return kept[next_++];
  }
  void Keep(const StageOutcome& outcome) override { added.push_back(outcome); }

  std::vector<StageOutcome> kept, added;

 private:
  size_t next_ = 0;
};

ShootingProblem Problem(double start = 0.4, int threads = 1) {
  const Model truth = Shipped("pendulum2_planar", {"coulomb_friction@joint1"},
                              {{"joint1.friction", 0.05}});
  const Model model = Shipped("pendulum2_planar");
  EstimationOptions options;
  options.threads = threads;
  SimulationOptions recording;
  recording.duration = 4.0;
  recording.rate = 100.0;
  recording.noise = 1e-3;
  return ShootingProblem(
      model, FreeFrom(model, {{"link1.length", start}, {"link2.length", 0.4}}),
      {Simulate(truth, Eigen::Vector4d(1.0, -0.5, 0.0, 0.0), recording)},
      options);
}

void ExpectSame(const Fit& a, const Fit& b) {
  EXPECT_EQ(a.point.theta, b.point.theta);
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_EQ(a.evaluations, b.evaluations);
  EXPECT_EQ(a.history.size(), b.history.size());
  EXPECT_EQ(a.termination, b.termination);
  EXPECT_EQ(a.train.total.normalized_rms, b.train.total.normalized_rms);
}

TEST(StageLog, AFitGoesOnFromEachOfItsStages) {
  const ShootingProblem problem = Problem();
  FirstStages all;
  const Fit whole = FitLevenbergMarquardt(problem, &all);
  ExpectSame(whole, FitLevenbergMarquardt(problem));
  ASSERT_GT(all.added.size(), 3u);
  for (size_t k = 1; k <= all.added.size(); ++k) {
    SCOPED_TRACE(k);
    FirstStages some;
    some.kept.assign(all.added.begin(), all.added.begin() + k);
    ExpectSame(FitLevenbergMarquardt(problem, &some), whole);
    EXPECT_EQ(some.added.size(), all.added.size() - k);
  }
}

TEST(Checkpoint, KeepsEveryBitOfTheStages) {
  const ShootingProblem problem = Problem();
  const std::string file = ::testing::TempDir() + "/checkpoint_test.cbor";
  Checkpoint first(file, problem, false);
  const Fit whole = FitLevenbergMarquardt(problem, &first);
  Checkpoint again(file, problem, true);
  EXPECT_GT(again.resumed(), 3u);
  ExpectSame(FitLevenbergMarquardt(problem, &again), whole);
  again.Remove();
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_EQ(Checkpoint(file, problem, true).resumed(), 0u);
}

// A spin that Runge and Kutta's steps would follow 64 to a sample.
TEST(Checkpoint, KeepsTheIntegratorThatAStageChose) {
  const std::vector<std::string> effects{"viscous_damping@joint1"};
  const Model truth = Shipped("pendulum1", effects, {{"joint1.damping", 1.5}});
  const Model model = Shipped("pendulum1", effects);
  SimulationOptions recording;
  recording.duration = 2.0;
  recording.noise = 1e-3;
  recording.step = 2e-5;
  const ShootingProblem problem(
      model, FreeFrom(model, {{"joint1.damping", 0.5}}),
      {Simulate(truth, RandomState(truth, 1.0, 1), recording)}, {});
  const std::string file = ::testing::TempDir() + "/integrator_test.cbor";
  Checkpoint first(file, problem, false);
  const Fit whole = FitLevenbergMarquardt(problem, &first);
  EXPECT_EQ(whole.point.rollout.integrator, Integrator::kRosenbrock2);
  const ParameterEstimate& damping = whole.parameters[0];
  EXPECT_NEAR(damping.value, 1.5, 4.0 * damping.std_error);
  Checkpoint again(file, problem, true);
  const Fit resumed = FitLevenbergMarquardt(problem, &again);
  ExpectSame(resumed, whole);
  EXPECT_EQ(resumed.point.rollout, whole.point.rollout);
  again.Remove();
}

// A double pendulum and three runs of it, of which processes have shares.
struct ThreeRuns {
  ThreeRuns() : model(Shipped("pendulum2_planar")) {
    SimulationOptions recording;
    recording.rate = 100.0;
    recording.noise = 1e-3;
    for (const double duration : {2.0, 1.0, 1.5}) {
      recording.duration = duration;
      recording.seed = runs.size() + 1;
      runs.push_back(
          Simulate(model, RandomState(model, 0.5, runs.size()), recording));
      runs.back().name = std::to_string(runs.size()) + ".csv";
    }
  }
  // What the first of the processes finds, and how many stages it resumed.
  std::pair<Fit, size_t> FitBy(const std::vector<std::vector<int>>& shares,
                               const std::string& file, bool resume) const {
    std::pair<Fit, size_t> found(model, 0);
    ThreadProcesses(static_cast<int>(shares.size()))
        .Run([&](const Processes& all) {
          const SharedPart own(all, runs, shares);
          const ShootingProblem problem(
              model,
              FreeFrom(model, {{"link1.length", 0.4}, {"link2.length", 0.4}}),
              own.runs, own.options);
          Checkpoint checkpoint(file, problem, resume);
          const Fit fit = FitLevenbergMarquardt(problem, &checkpoint);
          if (all.rank() == 0) found = {fit, checkpoint.resumed()};
        });
    return found;
  }

  Model model;
  std::vector<Run> runs;
};

TEST(Checkpoint, IsOfAllProcessesWhateverTheirNumber) {
  const ThreeRuns setup;
  const std::string file = ::testing::TempDir() + "/checkpoints_test.cbor";
  const auto [two, none] = setup.FitBy({{0}, {1, 2}}, file, false);
  EXPECT_EQ(none, 0u);
  for (const std::vector<std::vector<int>>& shares :
       {std::vector<std::vector<int>>{{0, 1, 2}},
        {{0}, {1, 2}},
        {{0, 1}, {}, {2}}}) {
    const auto [fit, stages] = setup.FitBy(shares, file, true);
    EXPECT_GT(stages, 1u);
    EXPECT_EQ(fit.point.theta, two.point.theta);
    EXPECT_EQ(fit.iterations, two.iterations);
  }
  std::filesystem::remove(file);
}

TEST(ProblemChecksum, IsOfAllThatDecidesAFit) {
  const std::uint64_t sum = ProblemChecksum(Problem());
  EXPECT_EQ(ProblemChecksum(Problem()), sum);
  EXPECT_EQ(ProblemChecksum(Problem(0.4, 2)), sum);
  EXPECT_NE(ProblemChecksum(Problem(0.41)), sum);
  EstimationOptions options = Problem().options();
  options.segment = 0.5;
  EXPECT_NE(ProblemChecksum(Problem().With(options)), sum);
  // The same numbers of another sensor.
  std::vector<sysid::Run> runs = RunsOf(*Problem().shared_data());
  runs[0].channels[0].target = 1;
  EXPECT_NE(ProblemChecksum(ShootingProblem(Problem().model(), Problem().free(),
                                            runs, Problem().options())),
            sum);
  // The same numbers, of which more is known.
  runs = RunsOf(*Problem().shared_data());
  runs[0].start = RunStart::kRest;
  EXPECT_NE(ProblemChecksum(ShootingProblem(Problem().model(), Problem().free(),
                                            runs, Problem().options())),
            sum);
  // The same parameters of another mechanism.
  Mechanism turned = Problem().model().mechanism();
  turned.joints[0].axis *= -1.0;
  const ShootingProblem problem = Problem();
  const Model other = MakeModel(turned, Catalogue());
  EXPECT_NE(
      ProblemChecksum(ShootingProblem(
          other, problem.free(), problem.shared_data(), problem.options())),
      sum);
  Mechanism weaker = Problem().model().mechanism();
  weaker.joints[0].effort_limit = 0.5;
  EXPECT_NE(ProblemChecksum(
                ShootingProblem(MakeModel(weaker, Catalogue()), problem.free(),
                                problem.shared_data(), problem.options())),
            sum);
}

}  // namespace
}  // namespace sysid
