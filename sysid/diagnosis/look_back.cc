// The part of the search that takes effects out again.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "sysid/diagnosis/rivals.h"
#include "sysid/diagnosis/search.h"

namespace sysid {
namespace {

constexpr size_t kMostExchanged = 2;

}  // namespace

bool Search::LookBack(const std::vector<std::string>& newest) {
  std::vector<std::string> older;
  for (const auto& effect : now().added) {
    if (std::find(newest.begin(), newest.end(), effect->name()) ==
            newest.end() &&
        !settled_.contains(effect->name())) {
      older.push_back(effect->name());
    }
  }
  bool any = false;
  for (const std::string& name : older) any = LookBackAt(name) || any;
  return any;
}

bool Search::LookBackAt(const std::string& name) {
  const EvaluatedModel& with = now();
  EvaluatedModel without = Without(name);
  if (!std::isfinite(without.train_error())) return false;
  DiagnosisStep step = StepFrom(with);
  step.removed = name;
  std::shared_ptr<EvaluatedModel> next;
  const bool needed = WasHere(without) || !WhyImplausible(without).empty() ||
                      IsWorse(without.cv, with.cv);
  if (!needed) {
    step.predicted = without.train_error();
    next = std::make_shared<EvaluatedModel>(std::move(without));
  } else {
    const Screening screening = Screen(without);
    std::vector<CandidateRefit> refits = ProposeEffects(screening);
    const int own = screening.IndexOf(name);
    std::erase_if(refits, [&](const CandidateRefit& refit) {
      return refit.effects[0] == own;
    });
    if (refits.size() > kMostExchanged) refits.resize(kMostExchanged);
    refits_.Confirm(without, &refits);
    // Which of them could stand in the place of an effect of the screening.
    const auto alternatives = [&](int effect, const EvaluatedModel& model) {
      std::vector<std::string> names;
      for (const CandidateRefit& refit : refits) {
        if (effect < 0 || refit.effects[0] == effect || !refit.accepted()) {
          continue;
        }
        if (StandFor(screening, effect, refit.effects[0], model,
                     *refit.after)) {
          names.push_back(refit.expected[0].name());
        }
      }
      return names;
    };
    const int best = refits_.Choose(refits);
    if (best < 0 || WasHere(*refits[best].after) ||
        !refits_.IsBetter(*refits[best].after, with)) {
      std::vector<std::string> tried;
      for (const CandidateRefit& refit : refits) {
        tried.push_back(refit.expected[0].name());
      }
      RemoveAlternatives(name, tried, &diagnosis_.steps);
      AddAlternatives(name, alternatives(own, with), &diagnosis_.steps);
      return false;
    }
    const ScreenedEffect& effect = refits[best].expected[0];
    step.effects = {effect.name()};
    step.indistinguishable_from = {
        alternatives(refits[best].effects[0], *refits[best].after)};
    // The one that goes may stand for the one that comes.
    if (own >= 0 && StandFor(screening, refits[best].effects[0], own,
                             *refits[best].after, with)) {
      step.indistinguishable_from[0].push_back(name);
    }
    step.predicted = refits[best].predicted;
    step.parameters = EstimatesOf(*refits[best].after, {effect.effect.get()});
    next = std::make_shared<EvaluatedModel>(std::move(*refits[best].after));
  }
  model_ = std::move(next);
  if (!model_->fit.converged) {
    *model_ = EvaluateAgain(problem_, std::move(*model_));
  }
  EndAt(model_, &step);
  diagnosis_.steps.push_back(step);
  return true;
}

std::vector<std::string> Search::AsGoodOverWholeRuns(
    const EvaluatedModel& model, const std::string& name) {
  std::vector<std::string> as_good;
  std::vector<ScreenedEffect> others = explain_the_same_[name];
  std::erase_if(others, [&](const ScreenedEffect& other) {
    return std::any_of(
        model.added.begin(), model.added.end(),
        [&](const auto& effect) { return effect->name() == other.name(); });
  });
  if (others.empty() || IsAtNoiseFloor(model) ||
      !CouldBeFollowedLonger(problem_, model)) {
    return as_good;
  }
  const auto error = [&](const EvaluatedModel& evaluated) {
    const std::optional<Fit> whole =
        FitWholeRuns(WithAllRuns(problem_, evaluated), evaluated);
    return whole ? whole->train.total.normalized_rms
                 : std::numeric_limits<double>::infinity();
  };
  Report("alternatives to " + name + " over whole runs", model.train_error());
  EstimationOptions options = Coarse(problem_.options, model.train_error());
  options.progress = nullptr;
  options.max_iterations = kRefitIterations;
  const double with = error(model);
  const EvaluatedModel without =
      EvaluateWithout(problem_, model, name, options);
  for (const ScreenedEffect& other : others) {
    Report("alternatives to " + name + " over whole runs", model.train_error());
    const EvaluatedModel instead =
        EvaluateWith(problem_, without, {&other}, options);
    if (error(instead) < (1.0 + kMatters) * with) {
      as_good.push_back(other.name());
    }
  }
  return as_good;
}

std::string Search::Chance(const EvaluatedModel& evaluated) {
  if (IsAtNoiseFloor(evaluated)) return "";
  Report("significance of the effects", evaluated.train_error());
  return LikeliestChance(problem_, evaluated, candidates_.size());
}

bool Search::TakeOutChance() {
  bool any = false;
  for (;; any = true) {
    DiagnosisStep step = StepFrom(now());
    step.removed = Chance(now());
    if (step.removed.empty()) return any;
    EstimationOptions options = problem_.options;
    options.progress = nullptr;
    model_ = std::make_shared<EvaluatedModel>(
        EvaluateWithout(problem_, now(), step.removed, options));
    step.predicted = model_->train_error();
    EndAt(model_, &step);
    diagnosis_.steps.push_back(std::move(step));
  }
}

}  // namespace sysid
