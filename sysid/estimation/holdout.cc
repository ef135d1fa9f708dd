#include "sysid/estimation/holdout.h"

#include <utility>

#include "models/math/constants.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/state_weights.h"

namespace sysid {
namespace {

Holdout EvaluateAt(Holdout holdout, Solution solution) {
  const ShootingProblem& problem = *holdout.problem;
  double states = 0.0;
  for (const auto& nodes : solution.runs) states += nodes.segments();
  states = SumOver(problem.processes(), states);
  holdout.point = std::move(solution);
  holdout.errors = EvaluateErrors(problem, holdout.point,
                                  states * ObservedStateDof(problem));
  return holdout;
}

Solution Independent(const ShootingProblem& problem, const Solution& start) {
  return SolveOneByOne(problem, {}, {start}, AllSegments(start));
}

}  // namespace

Holdout OpenHoldout(const Model& model,
                    const std::shared_ptr<const DataSet>& data,
                    const EstimationOptions& train,
                    const RolloutOptions& rollout, double segment_s) {
  EstimationOptions same = train;
  same.progress = nullptr;
  same.rollout = rollout;
  same.segment = segment_s;
  Holdout holdout;
  holdout.problem = std::make_shared<const ShootingProblem>(
      model, std::vector<FreeParameter>(), data, same);
  return holdout;
}

Holdout EvaluateHoldout(Holdout opened, const Solution* start) {
  const ShootingProblem& problem = *opened.problem;
  Solution solution =
      start != nullptr
          ? Independent(problem, *start)
          : StatesFromScratch(problem, problem.options().segment, kInfinity);
  return EvaluateAt(std::move(opened), std::move(solution));
}

Holdout EvaluateJoinedHoldout(Holdout opened) {
  const ShootingProblem& problem = *opened.problem;
  const Solution joined =
      StatesFromScratch(problem, problem.options().segment, kJoinedDefect);
  opened.open = EvaluateOpen(problem, joined);
  Solution solution = Independent(problem, joined);
  return EvaluateAt(std::move(opened), std::move(solution));
}

Holdout PredictHoldout(Holdout opened) {
  Holdout holdout = EvaluateHoldout(opened, nullptr);
  // For the open prediction one initial state has to serve the whole run; its
  // spins, where no sensor sees them, may be the better start of segments too.
  Holdout joined = EvaluateJoinedHoldout(std::move(opened));
  if (joined.errors.squares < holdout.errors.squares) return joined;
  holdout.open = std::move(joined.open);
  return holdout;
}

}  // namespace sysid
