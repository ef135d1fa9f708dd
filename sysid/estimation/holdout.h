#pragma once

#include <memory>
#include <vector>

#include "sysid/estimation/fit.h"

namespace sysid {

// Runs that were not fitted, predicted by a model. Each segment starts from a
// state that is estimated from that segment alone; the parameters stay.
struct Holdout {
  std::shared_ptr<const ShootingProblem> problem;  // nothing free
  RunErrors errors;
  std::vector<OpenError> open;
  Solution point;
  std::vector<EffortError> effort;  // as Fit::effort; its owner fills it in
};

// How held-out runs are predicted: as the fitted ones were, integrated and cut
// alike, without a report of progress. Nothing is estimated yet.
Holdout OpenHoldout(const Model& model,
                    const std::shared_ptr<const DataSet>& data,
                    const EstimationOptions& train,
                    const RolloutOptions& rollout, double segment_s);

// With the open prediction.
Holdout PredictHoldout(Holdout opened);
// Without it, which takes as long again. `start`: the solution of a model that
// is near, cut alike; null: from the data.
Holdout EvaluateHoldout(Holdout opened, const Solution* start);
// From one trajectory a run, with its open prediction: for models of whose
// states the data does not show all.
Holdout EvaluateJoinedHoldout(Holdout opened);

}  // namespace sysid
