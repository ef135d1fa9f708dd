#include "sysid/session/checkpoint.h"

#include <gmock/gmock.h>

#include <filesystem>

#include "tests/support/fit_setup.h"

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

TEST(ProblemChecksum, IsOfAllThatDecidesAFit) {
  const std::uint64_t sum = ProblemChecksum(Problem());
  EXPECT_EQ(ProblemChecksum(Problem()), sum);
  EXPECT_EQ(ProblemChecksum(Problem(0.4, 2)), sum);
  EXPECT_NE(ProblemChecksum(Problem(0.41)), sum);
  EstimationOptions options = Problem().options();
  options.segment = 0.5;
  EXPECT_NE(ProblemChecksum(Problem().With(options)), sum);
  // The same parameters of another mechanism.
  Mechanism turned = Problem().model().mechanism();
  turned.joints[0].axis *= -1.0;
  const ShootingProblem problem = Problem();
  const Model other = MakeModel(turned, Catalogue());
  EXPECT_NE(
      ProblemChecksum(ShootingProblem(
          other, problem.free(), problem.shared_data(), problem.options())),
      sum);
}

}  // namespace
}  // namespace sysid
