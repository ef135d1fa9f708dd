#include "sysid/linearization/columns_by_forces.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "residuals/parameter_forces.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/parallel.h"
#include "sysid/linearization/candidate_batch.h"

namespace sysid {
namespace {

// The forces of a batch's columns: scratch of one thread.
class BatchForces {
 public:
  BatchForces(const Model& fitted, const CandidateBatch& batch)
      : batch_(batch) {
    if (batch.IsSecant()) {
      secants_.emplace(fitted, batch.model(), batch.map(),
                       batch.theta() + batch.Secants());
    } else {
      derivatives_.emplace(batch.model(), batch.map(), batch.theta(),
                           batch.alone());
    }
  }

  // Of a segment, to their columns of `out`.
  void Write(const SegmentRollout& rollout, const SegmentTangent& tangent,
             ParameterForces* out) {
    if (derivatives_) {
      derivatives_->Write(rollout, tangent, batch_.columns(), out);
    } else {
      secants_->Write(rollout, tangent, batch_.alone(), batch_.columns(),
                      batch_.Secants(), out);
    }
  }

 private:
  const CandidateBatch& batch_;
  std::optional<ForceDifference> secants_;
  std::optional<ForceDerivatives> derivatives_;
};

}  // namespace

ColumnsByForces::ColumnsByForces(const LinearizedFit& fit, const Model& fitted)
    : fit_(fit), fitted_(fitted), response_(fit), says_(response_.Valid()) {
  const EffectSet& effects = fitted.effects();
  for (int i = 0; i < effects.size(); ++i) {
    if ((effects.effect(i).hooks() & (kStateRateHook | kLimitHook)) != 0) {
      says_ = false;
    }
  }
  if (!says_) return;
  const ShootingProblem& problem = fit.problem();
  const auto& segments = fit.segments();
  std::vector<Eigen::MatrixXd> theta(segments.size());
  ParallelFor(
      static_cast<int>(segments.size()), problem.options().threads, [&](int s) {
        const LinearizedFit::Segment& at = *segments[s];
        const ParameterForces forces =
            ForceDerivatives(problem.model(), problem.map(), fit.point().theta)
                .Along(*at.rollout, response_.tangent(s));
        const Eigen::MatrixXd columns =
            fit.WithoutStates(at, response_.Respond(s, forces));
        theta[s] = columns(Eigen::all, fit.kept());
        return true;
      });
  theta_ = fit.Span(theta);
}

bool ColumnsByForces::Says(const Candidate& candidate) const {
  return says_ && !Saturates(candidate);
}

void ColumnsByForces::ForEachSegment(
    const std::vector<Candidate>& candidates,
    const std::vector<CandidateSet>& sets,
    const std::function<void(int, const Eigen::MatrixXd&)>& visit) const {
  const int total = CountColumns(candidates, sets);
  const auto& segments = fit_.segments();
  const auto batches =
      MakeBatches(fitted_, candidates, sets, CandidateBatch::By::kForces);
  const int threads = std::max(1, fit_.problem().options().threads);
  std::vector<std::vector<std::unique_ptr<BatchForces>>> scratch(threads);
  const std::stop_token& stop = fit_.problem().options().stop;
  ParallelFor(static_cast<int>(segments.size()), threads, [&](int s, int t) {
    if (stop.stop_requested()) return false;
    const SegmentRollout& rollout = *segments[s]->rollout;
    ParameterForces forces = ParameterForces::Zero(rollout, total);
    if (scratch[t].empty()) {
      for (const auto& batch : batches) {
        scratch[t].push_back(std::make_unique<BatchForces>(fitted_, *batch));
      }
    }
    for (const auto& of_batch : scratch[t]) {
      of_batch->Write(rollout, response_.tangent(s), &forces);
    }
    visit(s, response_.Respond(s, forces));
    return true;
  });
  ThrowIfCancelled(stop);
}

}  // namespace sysid
