#include "sysid/estimation/cancelled.h"

#include <gmock/gmock.h>

#include <atomic>
#include <cmath>
#include <functional>
#include <optional>

#include "sysid/diagnosis/diagnose.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

// A pendulum with friction that the model lacks.
DiagnosisProblem Rubbing(double duration = 2.0) {
  const Model truth = Shipped("pendulum2_planar", {"coulomb_friction@joint1"},
                              {{"joint1.friction", 0.05}});
  Recording recording;
  recording.duration = duration;
  return MakeProblem(Shipped("pendulum2_planar"),
                     {{"link1.length", 0.4}, {"link2.length", 0.4}},
                     {Record(truth, 1, recording), Record(truth, 2, recording),
                      Record(truth, 3, recording)});
}

// Asks to stop at the given report of progress (-1: never) and counts them.
struct Stopper {
  explicit Stopper(EstimationOptions* options) {
    options->stop = source.get_token();
    options->progress = [this](const Progress& progress) {
      doing.push_back(progress.doing);
      if (static_cast<int>(doing.size()) == at) source.request_stop();
    };
  }

  int at = -1;
  std::stop_source source;
  std::vector<std::string> doing;
};

TEST(Cancelled, EndsAFitAtItsNextIteration) {
  const DiagnosisProblem runs = Rubbing();
  const std::function<Fit(const ShootingProblem&)> fits[] = {
      FitLevenbergMarquardt,
      [](const ShootingProblem& p) { return FitIndependentSegments(p); }};
  for (const auto& fit : fits) {
    for (const int at : {1, 4}) {
      EstimationOptions options = runs.options;
      Stopper stopper(&options);
      stopper.at = at;
      ShootingProblem problem(runs.model, runs.free, runs.train, options);
      EXPECT_THROW(fit(problem), Cancelled);
      EXPECT_EQ(stopper.doing.size(), at);
    }
  }
}

// Wherever it is: no report follows, and nothing is returned.
TEST(Cancelled, EndsADiagnosisInEachOfItsParts) {
  DiagnosisProblem problem = Rubbing();
  const auto candidates = AllCandidates(problem.model);
  std::vector<std::string> parts;
  {
    Stopper never(&problem.options);
    Diagnose(problem, candidates, {});
    parts = never.doing;
  }
  ASSERT_GT(parts.size(), 10u);
  for (size_t i = 0; i < parts.size(); ++i) {
    if (i > 0 && parts[i] == parts[i - 1]) continue;
    SCOPED_TRACE(parts[i]);
    Stopper stopper(&problem.options);
    stopper.at = static_cast<int>(i) + 1;
    EXPECT_THROW(Diagnose(problem, candidates, {}), Cancelled);
    EXPECT_EQ(stopper.doing.size(), i + 1);
  }
}

// The parts of long work that report progress, in order, each once, with the
// number of its first report.
std::vector<std::pair<std::string, int>> Parts(
    const std::vector<std::string>& doing) {
  std::vector<std::pair<std::string, int>> parts;
  for (size_t i = 0; i < doing.size(); ++i) {
    if (parts.empty() || parts.back().first != doing[i]) {
      parts.emplace_back(doing[i], static_cast<int>(i) + 1);
    }
  }
  return parts;
}

TEST(Interrupted, FitHasItsBestPointFromEachOfItsStages) {
  const DiagnosisProblem runs = Rubbing();
  EstimationOptions options = runs.options;
  options.keep_best = true;
  std::vector<std::string> doing;
  {
    Stopper never(&options);
    ShootingProblem problem(runs.model, runs.free, runs.train, options);
    EXPECT_TRUE(FitLevenbergMarquardt(problem).converged);
    doing = never.doing;
  }
  {
    // Before a step was taken there is nothing to keep.
    Stopper stopper(&options);
    stopper.source.request_stop();
    ShootingProblem problem(runs.model, runs.free, runs.train, options);
    EXPECT_THROW(FitLevenbergMarquardt(problem), Cancelled);
  }
  const auto parts = Parts(doing);
  ASSERT_GE(parts.size(), 3u);
  for (const auto& [stage, first] : parts) {
    SCOPED_TRACE(stage);
    Stopper stopper(&options);
    stopper.at = first;
    ShootingProblem problem(runs.model, runs.free, runs.train, options);
    const Fit fit = FitLevenbergMarquardt(problem);
    EXPECT_FALSE(fit.converged);
    EXPECT_GT(fit.iterations, 0);
    EXPECT_EQ(fit.iterations, fit.history.back().iteration);
    EXPECT_THAT(
        fit.termination,
        ::testing::HasSubstr("interrupted after " +
                             std::to_string(fit.iterations) + " iterations"));
    EXPECT_EQ(fit.point.theta, fit.history.back().theta);
    const double error = fit.train.total.normalized_rms;
    EXPECT_TRUE(std::isfinite(error));
    for (const ParameterEstimate& p : fit.parameters) {
      EXPECT_TRUE(std::isfinite(p.value)) << p.name;
    }
  }
}

TEST(Interrupted, FitsThatAreJudgedKeepNothing) {
  const DiagnosisProblem runs = Rubbing();
  EstimationOptions options = runs.options;
  options.keep_best = true;
  Stopper stopper(&options);
  stopper.at = 6;
  ShootingProblem problem(runs.model, runs.free, runs.train, options);
  EXPECT_THROW(FitIndependentSegments(problem), Cancelled);
}

TEST(Interrupted, DiagnosisHasWhatItJudgedByThen) {
  DiagnosisProblem problem = Rubbing(5.0);
  const auto candidates = AllCandidates(problem.model);
  DiagnosisOptions options;
  options.add = options.keep_evaluated = true;
  std::vector<std::string> doing;
  {
    Stopper never(&problem.options);
    const Diagnosis whole = Diagnose(problem, candidates, options);
    EXPECT_EQ(whole.interrupted, "");
    EXPECT_EQ(whole.added(),
              std::vector<std::string>{"coulomb_friction@joint1"});
    doing = never.doing;
  }
  bool judged = false, stepped = false;
  for (const auto& [part, first] : Parts(doing)) {
    SCOPED_TRACE(part);
    Stopper stopper(&problem.options);
    stopper.at = first;
    std::optional<Diagnosis> diagnosis;
    try {
      diagnosis = Diagnose(problem, candidates, options);
    } catch (const Cancelled&) {
      EXPECT_FALSE(judged) << "once there is a evaluated, it is kept";
      continue;
    }
    judged = true;
    EXPECT_NE(diagnosis->interrupted, "");
    EXPECT_GT(diagnosis->base.train_error(), 1.0);
    // The model rubs: nothing that was judged may call it adequate.
    EXPECT_NE(diagnosis->verdict, Verdict::kAdequate);
    for (const DiagnosisStep& step : diagnosis->steps) {
      stepped = true;
      EXPECT_LT(step.train_after, step.train_before);
    }
    if (!diagnosis->steps.empty()) {
      EXPECT_EQ(diagnosis->final, diagnosis->steps.back().after);
    }
  }
  EXPECT_TRUE(judged);
  EXPECT_TRUE(stepped);
}

TEST(Cancelled, IsNothingWhereNobodyAsks) {
  EXPECT_NO_THROW(ThrowIfCancelled({}));
  std::stop_source source;
  EXPECT_NO_THROW(ThrowIfCancelled(source.get_token()));
  source.request_stop();
  EXPECT_THROW(ThrowIfCancelled(source.get_token()), Cancelled);
}

}  // namespace
}  // namespace sysid
