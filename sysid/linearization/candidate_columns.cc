#include "sysid/linearization/candidate_columns.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "models/error.h"
#include "models/internal_state.h"
#include "sysid/estimation/parallel.h"
#include "sysid/linearization/candidate_batch.h"

namespace sysid {
namespace {

// Secants of stiff laws (friction, elastic drives) are rolled out with the
// steps of the fit, but with so many a sample at least, over so many sizes at
// most.
constexpr int kSecantSteps = 8;
constexpr int kMostSecants = 6;

// Writes the derivatives of a segment's errors, SI, into the batch's columns of
// `out`. False where the dynamics fail.
bool EvaluateBatch(const CandidateBatch& batch, const LinearizedFit& fit,
                   const LinearizedFit::Segment& at, SegmentScratch* scratch,
                   RowMatrixXd* out) {
  RolloutOptions options = at.rollout->options();
  if (batch.has_state() && batch.IsSecant()) {
    // What it swings at is not what the fit's steps were chosen for.
    const double longest =
        fit.problem().data().MedianSamplePeriod() / kSecantSteps;
    options.step = options.step > 0 ? std::min(options.step, longest) : longest;
  }
  const Model& model = batch.model();
  const SegmentRollout rollout(&model, &batch.map(),
                               &at.rollout->measurements(), at.rollout->first(),
                               at.rollout->last(), options);
  Eigen::VectorXd errors(rollout.num_residuals());
  std::vector<double> x_end(model.state_size());
  const Eigen::VectorXd x0 =
      AdoptState(fit.problem().model(), fit.StateOf(at), model);
  const std::vector<int>& columns = batch.columns();
  if (batch.IsSecant()) {
    const Eigen::VectorXd moved = batch.theta() + batch.Secants();
    if (!rollout(x0.data(), moved.data(), errors.data(), x_end.data())) {
      return false;
    }
    out->col(columns[0]) = (errors - at.errors) / batch.Secants()[0];
    return true;
  }
  RowMatrixXd J, J_end;
  if (!rollout.LinearizeByTheta(x0.data(), batch.theta().data(), errors.data(),
                                x_end.data(), &J, &J_end, scratch)) {
    return false;
  }
  for (size_t c = 0; c < columns.size(); ++c) out->col(columns[c]) = J.col(c);
  return true;
}

// The whitened errors of each segment from its state, by rolling out with finer
// steps; false where the dynamics fail.
bool RollOut(const LinearizedFit& fit, const Model& model,
             std::vector<Eigen::VectorXd>* errors) {
  const ShootingProblem& problem = fit.problem();
  RolloutOptions options = fit.point().rollout;
  const double longest = problem.data().MedianSamplePeriod() / kSecantSteps;
  options.step = options.step > 0 ? std::min(options.step, longest) : longest;
  const ParameterMap nothing(model, {});
  const auto& segments = fit.segments();
  errors->resize(segments.size());
  return ParallelFor(
      static_cast<int>(segments.size()), problem.options().threads,
      problem.options().stop, [&](int s) {
        const LinearizedFit::Segment& at = *segments[s];
        const SegmentRollout rollout(
            &model, &nothing, &problem.runs()[at.run]->measurements,
            at.rollout->first(), at.rollout->last(), options);
        Eigen::VectorXd& out = (*errors)[s];
        out.resize(rollout.num_residuals());
        std::vector<double> x_end(model.state_size());
        const Eigen::VectorXd x0 =
            AdoptState(problem.model(), fit.StateOf(at), model);
        if (!rollout(x0.data(), static_cast<const double*>(nullptr), out.data(),
                     x_end.data())) {
          return false;
        }
        MakeWhitening(problem, at.run, *at.rollout).Apply(out.data(), {});
        return out.allFinite();
      });
}

// The secant over the size that changes the errors about as much as there is to
// explain, beside what the states undo: a model that lacks the effect may have
// put its errors into spins, and the least of a friction stops those.
void UseSecant(const LinearizedFit& fit, const Candidate& candidate,
               const Probe& probe, int column,
               const std::vector<Eigen::VectorXd>& off,
               std::vector<Eigen::MatrixXd>* responses) {
  const Effect& effect = *candidate.effect;
  const double wanted = std::sqrt(fit.SumOfSquares());
  double length = 0.0;
  for (const Eigen::MatrixXd& response : *responses) {
    length += response.col(column).squaredNorm();
  }
  length = std::sqrt(length);
  // Not even its typical size shows.
  if (length * effect.parameters()[probe.along].typical_scale < 1e-3) return;
  const std::vector<double> from = candidate.At(probe);
  Model on = candidate.model;
  for (size_t p = 0; p < from.size(); ++p) {
    on.SetEffectParameter(effect.parameters()[p].name, from[p]);
  }
  double size = wanted / length, best_size = 0.0;
  std::vector<Eigen::VectorXd> errors, best;
  for (int k = 0; k < kMostSecants; ++k) {
    on.SetEffectParameter(effect.parameters()[probe.along].name,
                          from[probe.along] + size);
    if (!RollOut(fit, on, &errors)) break;
    best = errors;
    best_size = size;
    double change = 0.0;
    for (size_t s = 0; s < off.size(); ++s) {
      change += fit.WithoutStates(*fit.segments()[s], errors[s] - off[s])
                    .squaredNorm();
    }
    change = std::sqrt(change);
    if (change > 0.7 * wanted) break;
    size *= std::clamp(wanted / change, 2.0, 10.0);
  }
  for (size_t s = 0; s < best.size(); ++s) {
    (*responses)[s].col(column) = (best[s] - off[s]) / best_size;
  }
}

void UseSecants(const LinearizedFit& fit, const Model& fitted,
                const std::vector<Candidate>& candidates,
                const std::vector<CandidateSet>& sets,
                std::vector<Eigen::MatrixXd>* responses) {
  std::vector<Eigen::VectorXd> off;
  int column = 0;
  for (const CandidateSet& at : sets) {
    const Candidate& candidate = candidates[at.candidate];
    const int first = column;
    column += candidate.columns(at.set);
    if (!Saturates(candidate)) continue;
    if (off.empty() && !RollOut(fit, fitted, &off)) return;
    const ProbeSet& probes = candidate.sets[at.set];
    for (size_t i = 0; i < probes.size(); ++i) {
      UseSecant(fit, candidate, probes[i], first + static_cast<int>(i), off,
                responses);
    }
  }
}

// Whether an effect has parameters of these.
bool Shares(const EffectSet& effects, const Effect& effect) {
  const auto is_own = [&](const EffectParameter& parameter) {
    return std::any_of(
        effect.parameters().begin(), effect.parameters().end(),
        [&](const EffectParameter& own) { return own.name == parameter.name; });
  };
  return std::any_of(effects.parameters().begin(), effects.parameters().end(),
                     is_own);
}

}  // namespace

std::vector<Candidate> MakeCandidates(
    const Model& fitted,
    const std::vector<std::shared_ptr<const Effect>>& effects,
    const std::set<std::string>& taken) {
  std::vector<Candidate> candidates;
  for (const auto& effect : effects) {
    if (fitted.effects().Contains(effect->name()) ||
        (effect->Extends() && !Shares(fitted.effects(), *effect))) {
      continue;
    }
    Candidate candidate(fitted);
    candidate.effect = effect;
    try {
      candidate.model.AddEffect(effect);
    } catch (const InputError&) {
      continue;  // part of an effect that is in the model
    }
    std::vector<std::string> names;
    for (const EffectParameter& own : effect->parameters()) {
      names.push_back(own.name);
    }
    for (const std::string& name : effect->adjusts_nominal()) {
      if (taken.count(name) == 0) names.push_back(name);
    }
    candidate.parameters =
        FindParameters(candidate.model, names, effect->name());
    candidate.sets = effect->ProbeSets();
    if (candidate.sets.empty()) candidate.sets.push_back({});
    if (candidate.columns(0) == 0) continue;
    candidates.push_back(std::move(candidate));
  }
  return candidates;
}

bool Saturates(const Candidate& candidate) {
  const int joint = candidate.effect->joint();
  return joint >= 0 &&
         candidate.model.mechanism().joints[joint].type ==
             JointType::kSpherical &&
         (candidate.effect->hooks() & (kEffortHook | kJointInertiaHook)) != 0;
}

std::vector<Eigen::MatrixXd> RespondToCandidates(
    const LinearizedFit& fit, const Model& fitted,
    const std::vector<Candidate>& candidates,
    const std::vector<CandidateSet>& sets) {
  const int total = CountColumns(candidates, sets);
  const auto& segments = fit.segments();
  std::vector<Eigen::MatrixXd> responses(segments.size());
  const auto batches =
      MakeBatches(fitted, candidates, sets, CandidateBatch::By::kRollouts);
  std::vector<ScratchPool> pools(batches.size());
  ParallelFor(static_cast<int>(segments.size()),
              fit.problem().options().threads, fit.problem().options().stop,
              [&](int s) {
                const LinearizedFit::Segment& at = *segments[s];
                RowMatrixXd columns = RowMatrixXd::Zero(at.rows(), total);
                for (size_t b = 0; b < batches.size(); ++b) {
                  std::unique_ptr<SegmentScratch> scratch = pools[b].Take();
                  EvaluateBatch(*batches[b], fit, at, scratch.get(), &columns);
                  pools[b].Give(std::move(scratch));
                }
                responses[s] = fit.Whiten(at, std::move(columns));
                return true;
              });
  UseSecants(fit, fitted, candidates, sets, &responses);
  return responses;
}

}  // namespace sysid
