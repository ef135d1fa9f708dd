#include "sysid/diagnosis/candidate_columns.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "glog/logging.h"
#include "models/error.h"
#include "models/internal_state.h"
#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

// Secants of stiff laws (friction, elastic drives) are rolled out with the
// steps of the fit, but with so many a sample at least, over so many sizes at
// most.
constexpr int kSecantSteps = 8;
constexpr int kMostSecants = 6;

// Columns that are taken together: by parameters of one model that has their
// effects in it, each off. Off, an effect does nothing, so the derivative by
// another's parameter is what it is without it.
class Batch {
 public:
  explicit Batch(const Model& fitted) : model_(fitted) {}

  // False where a column of a set cannot be had beside those that are there: by
  // another value of what is searched, by the same parameter, or where one of
  // them is a secant, which changes the model, so that it is alone.
  bool TakeIn(const Candidate& candidate, int set, int column) {
    const std::string& name =
        candidate.parameters[candidate.ParameterOf(set, column)].name;
    const ProbeSet& probes = candidate.sets[set];
    const Probe* probe =
        column < static_cast<int>(probes.size()) ? &probes[column] : nullptr;
    const double secant = probe != nullptr ? probe->secant : 0.0;
    if (secant_ != 0.0 || (secant != 0.0 && !names_.empty()) ||
        std::find(names_.begin(), names_.end(), name) != names_.end() ||
        (probe != nullptr && !Admit(candidate, candidate.At(*probe)))) {
      return false;
    }
    secant_ = secant;
    has_state_ = !candidate.effect->states().empty();
    names_.push_back(name);
    columns_.push_back(candidate.first[set] + column);
    return true;
  }

  // After the last: theta, at the values that the model has.
  void Close() {
    map_.emplace(model_, FindParameters(model_, names_, ""), false);
    theta_.resize(map_->size());
    for (int i = 0; i < map_->size(); ++i) {
      theta_[i] = map_->parameters()[i].nominal;
    }
  }

  // Writes the derivatives of a segment's errors, SI, into its columns of
  // `out`. False where the dynamics fail.
  bool Evaluate(const LinearizedFit& fit, const LinearizedFit::Segment& at,
                RowMatrixXd* out) {
    RolloutOptions options = at.rollout->options();
    if (has_state_ && secant_ != 0.0) {
      // What it swings at is not what the fit's steps were chosen for.
      const double longest =
          fit.problem().data().MedianSamplePeriod() / kSecantSteps;
      options.step =
          options.step > 0 ? std::min(options.step, longest) : longest;
    }
    const SegmentRollout rollout(&model_, &*map_, &at.rollout->measurements(),
                                 at.rollout->first(), at.rollout->last(),
                                 options);
    Eigen::VectorXd errors(rollout.num_residuals());
    std::vector<double> x_end(model_.state_size());
    const Eigen::VectorXd x0 =
        AdoptState(fit.problem().model(), fit.StateOf(at), model_);
    if (secant_ != 0.0) {
      Eigen::VectorXd moved = theta_;
      moved[0] += secant_;
      if (!rollout(x0.data(), moved.data(), errors.data(), x_end.data())) {
        return false;
      }
      out->col(columns_.front()) = (errors - at.errors) / secant_;
      return true;
    }
    RowMatrixXd J, J_end;
    std::unique_ptr<SegmentScratch> scratch = pool_.Take();
    const bool ok =
        rollout.LinearizeByTheta(x0.data(), theta_.data(), errors.data(),
                                 x_end.data(), &J, &J_end, scratch.get());
    pool_.Give(std::move(scratch));
    for (size_t c = 0; ok && c < columns_.size(); ++c) {
      out->col(columns_[c]) = J.col(c);
    }
    return ok;
  }

 private:
  // Puts the effect into the model, off, its own parameters `at` these values;
  // false where it is there with others, or another of the batch shares a
  // parameter with it.
  bool Admit(const Candidate& candidate, const std::vector<double>& at) {
    const auto same = values_.find(candidate.effect->name());
    if (same != values_.end()) return same->second == at;
    const std::vector<std::string> names = candidate.effect->ParameterNames();
    for (const std::string& name : names) {
      if (taken_.contains(name)) return false;
    }
    try {
      model_.AddEffect(candidate.effect);
    } catch (const InputError&) {
      return false;
    }
    taken_.insert(names.begin(), names.end());
    values_[candidate.effect->name()] = at;
    for (size_t p = 0; p < at.size(); ++p) {
      model_.SetEffectParameter(candidate.parameters[p].name, at[p]);
    }
    return true;
  }

  Model model_;
  std::vector<std::string> names_;  // of the parameters
  std::vector<int> columns_;        // of each, among all
  // Of each effect its own parameters, as they are set.
  std::map<std::string, std::vector<double>> values_;
  std::set<std::string> taken_;  // parameters of its effects
  double secant_ = 0.0;
  bool has_state_ = false;           // the secant's effect
  std::optional<ParameterMap> map_;  // points to the model
  Eigen::VectorXd theta_;
  ScratchPool pool_;
};

// Every probe of every candidate, in as few batches as can be.
std::vector<std::unique_ptr<Batch>> MakeBatches(
    const Model& fitted, const std::vector<Candidate>& candidates) {
  std::vector<std::unique_ptr<Batch>> batches;
  for (const Candidate& candidate : candidates) {
    for (int s = 0; s < static_cast<int>(candidate.sets.size()); ++s) {
      for (int i = 0; i < candidate.columns(s); ++i) {
        const auto takes_in = [&](const auto& batch) {
          return batch->TakeIn(candidate, s, i);
        };
        if (std::any_of(batches.begin(), batches.end(), takes_in)) continue;
        batches.push_back(std::make_unique<Batch>(fitted));
        CHECK(takes_in(batches.back()));
      }
    }
  }
  for (const auto& batch : batches) batch->Close();
  return batches;
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

// On a spherical joint whose link is thin, whatever turns it about its own axis
// is soon saturated: a friction stops that spin long before the derivative at
// null would have it.
bool NeedsSecant(const Model& model, const Candidate& candidate) {
  const int joint = candidate.effect->joint();
  return joint >= 0 &&
         model.mechanism().joints[joint].type == JointType::kSpherical &&
         (candidate.effect->hooks() & (kEffortHook | kJointInertiaHook)) != 0;
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
                std::vector<Eigen::MatrixXd>* responses) {
  std::vector<Eigen::VectorXd> off;
  for (const Candidate& candidate : candidates) {
    if (!NeedsSecant(fitted, candidate)) continue;
    if (off.empty() && !RollOut(fit, fitted, &off)) return;
    for (size_t s = 0; s < candidate.sets.size(); ++s) {
      for (size_t i = 0; i < candidate.sets[s].size(); ++i) {
        UseSecant(fit, candidate, candidate.sets[s][i],
                  candidate.first[s] + static_cast<int>(i), off, responses);
      }
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
  int total = 0;
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
    for (size_t s = 0; s < candidate.sets.size(); ++s) {
      candidate.first.push_back(total);
      total += candidate.columns(static_cast<int>(s));
    }
    candidates.push_back(std::move(candidate));
  }
  return candidates;
}

std::vector<Eigen::MatrixXd> RespondToCandidates(
    const LinearizedFit& fit, const Model& fitted,
    const std::vector<Candidate>& candidates) {
  int total = 0;
  for (const Candidate& candidate : candidates) {
    for (size_t s = 0; s < candidate.sets.size(); ++s) {
      total += candidate.columns(static_cast<int>(s));
    }
  }
  const auto& segments = fit.segments();
  std::vector<Eigen::MatrixXd> responses(segments.size());
  const std::vector<std::unique_ptr<Batch>> batches =
      MakeBatches(fitted, candidates);
  ParallelFor(static_cast<int>(segments.size()),
              fit.problem().options().threads, fit.problem().options().stop,
              [&](int s) {
                const LinearizedFit::Segment& at = *segments[s];
                RowMatrixXd columns = RowMatrixXd::Zero(at.rows(), total);
                for (const auto& batch : batches)
                  batch->Evaluate(fit, at, &columns);
                responses[s] = fit.Whiten(at, std::move(columns));
                return true;
              });
  UseSecants(fit, fitted, candidates, &responses);
  return responses;
}

}  // namespace sysid
