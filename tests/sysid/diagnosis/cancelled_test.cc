#include "sysid/estimation/cancelled.h"

#include <gmock/gmock.h>

#include <atomic>

#include "sysid/diagnosis/diagnose.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

// A pendulum with friction that the model lacks.
DiagnosisProblem Rubbing() {
  const Model truth = Shipped("pendulum2_planar", {"coulomb_friction@joint1"},
                              {{"joint1.friction", 0.05}});
  Recording recording;
  recording.duration = 2.0;
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
  for (const auto fit : {FitLevenbergMarquardt, FitIndependentSegments}) {
    for (const int at : {1, 4}) {
      EstimationOptions options = runs.options;
      Stopper stopper(&options);
      stopper.at = at;
      ShootingProblem problem(runs.model, runs.free, runs.train, options);
      EXPECT_THROW(fit(&problem), Cancelled);
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

TEST(Cancelled, IsNothingWhereNobodyAsks) {
  EXPECT_NO_THROW(ThrowIfCancelled({}));
  std::stop_source source;
  EXPECT_NO_THROW(ThrowIfCancelled(source.get_token()));
  source.request_stop();
  EXPECT_THROW(ThrowIfCancelled(source.get_token()), Cancelled);
}

}  // namespace
}  // namespace sysid
