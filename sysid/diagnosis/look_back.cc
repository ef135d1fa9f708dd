// The part of the search that takes effects out again.

#include <algorithm>
#include <cmath>
#include <optional>

#include "sysid/diagnosis/rivals.h"
#include "sysid/diagnosis/search.h"

namespace sysid {
namespace {

constexpr size_t kMostExchanged = 2;

bool IsNoWorse(const EvaluatedModel& simpler, const EvaluatedModel& model) {
  return std::isfinite(simpler.cv.error()) && WhyImplausible(simpler).empty() &&
         !IsWorse(simpler.cv, model.cv);
}

}  // namespace

bool Search::LookBack(const std::vector<std::string>& newest, bool exchange) {
  std::vector<std::string> older;
  for (const auto& effect : now().added) {
    if (std::find(newest.begin(), newest.end(), effect->name()) ==
            newest.end() &&
        !settled_.contains(effect->name())) {
      older.push_back(effect->name());
    }
  }
  bool any = false;
  for (const std::string& name : older) any = LookBackAt(name, exchange) || any;
  return any;
}

bool Search::LookBackAt(const std::string& name, bool exchange) {
  const EvaluatedModel& with = now();
  EvaluatedModel without = Without(name, with);
  if (!std::isfinite(without.train_error())) return false;
  DiagnosisStep step = StepFrom(with);
  step.removed = name;
  std::shared_ptr<EvaluatedModel> next;
  std::shared_ptr<const Effect> came;
  // What is adequate without it misses nothing.
  const bool worse = !IsAtNoiseFloor(without) && IsWorse(without.cv, with.cv);
  const bool needed =
      WasHere(without) || !WhyImplausible(without).empty() || worse;
  if (!needed) {
    step.predicted = without.train_error();
    next = std::make_shared<EvaluatedModel>(std::move(without));
  } else if (!exchange) {
    return false;
  } else {
    const Screening screening = Screen(without);
    std::vector<CandidateRefit> refits = ProposeEffects(screening);
    const int own = screening.IndexOf(name);
    std::erase_if(refits, [&](const CandidateRefit& refit) {
      return refit.effects[0] == own;
    });
    std::vector<std::string> tried;
    std::erase_if(refits, [&](const CandidateRefit& refit) {
      const bool far = refit.predicted > kNear * with.train_error();
      if (far) tried.push_back(refit.expected[0].name());
      return far;
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
        !TakesThePlaceOf(*refits[best].after, with)) {
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
    explain_the_same_[effect.name()] = {name};
    step.predicted = refits[best].predicted;
    came = effect.effect;
    next = std::make_shared<EvaluatedModel>(std::move(*refits[best].after));
  }
  model_ = std::move(next);
  *model_ = EvaluateAgain(problem_, std::move(*model_));
  if (came) step.parameters = EstimatesOf(*model_, {came.get()});
  EndAt(model_, &step);
  diagnosis_.steps.push_back(step);
  return true;
}

void Search::FoldRemovals() {
  std::vector<DiagnosisStep>& steps = diagnosis_.steps;
  while (steps.size() > 1 && steps.back().effects.empty()) {
    DiagnosisStep& step = steps[steps.size() - 2];
    const auto at = std::find(step.effects.begin(), step.effects.end(),
                              steps.back().removed);
    if (at == step.effects.end() || step.effects.size() == 1) return;
    step.indistinguishable_from.erase(step.indistinguishable_from.begin() +
                                      (at - step.effects.begin()));
    step.effects.erase(at);
    std::vector<const Effect*> effects;
    for (const auto& effect : model_->added) {
      if (std::find(step.effects.begin(), step.effects.end(), effect->name()) !=
          step.effects.end()) {
        effects.push_back(effect.get());
      }
    }
    step.parameters = EstimatesOf(*model_, effects);
    step.predicted = steps.back().predicted;
    EndAt(steps.back().after, &step);
    steps.pop_back();
  }
}

bool Search::AskAlternativesAgain() {
  const std::vector<std::shared_ptr<const Effect>> effects = model_->added;
  for (const auto& effect : effects) {
    const std::string& name = effect->name();
    if (settled_.contains(name)) continue;
    std::vector<std::string> others = AlternativesTo(name, diagnosis_.steps);
    AddNames(explain_the_same_[name], &others);
    // What took the place of another was compared with few; what was added,
    // with all that is alike (AddRivals).
    const bool exchanged = std::any_of(
        diagnosis_.steps.begin(), diagnosis_.steps.end(),
        [&](const DiagnosisStep& step) {
          return !step.removed.empty() && step.effects.size() == 1 &&
                 step.effects[0] == name;
        });
    if (others.empty() && !exchanged) continue;
    std::vector<Instead> instead =
        AsGoodInstead(*model_, name, others, exchanged);
    RemoveAlternatives(name, others, &diagnosis_.steps);
    AddAlternatives(name, NamesOf(instead), &diagnosis_.steps);
    if (Exchange(name, std::move(instead))) return true;
  }
  return false;
}

bool Search::Exchange(const std::string& name, std::vector<Instead> instead) {
  const size_t parameters = model_->fit.parameters.size();
  std::erase_if(instead, [&](const Instead& one) {
    return !one.better || one.model.fit.parameters.size() > parameters ||
           IsWorse(one.model.cv, model_->cv) ||
           exchanged_.contains(EffectsOf(one.model));
  });
  const auto best = std::min_element(
      instead.begin(), instead.end(),
      [](const Instead& a, const Instead& b) { return a.error < b.error; });
  if (best == instead.end() || !Chance(best->model).empty()) return false;
  exchanged_.insert(EffectsOf(*model_));
  DiagnosisStep step = StepFrom(*model_);
  step.removed = name;
  step.effects = {best->effect.name()};
  step.indistinguishable_from = {{}};
  if (!std::isnan(best->whole_before)) {
    step.whole_before = best->whole_before;
    step.whole_after = best->error;
  }
  step.predicted = best->model.train_error();
  model_ = std::make_shared<EvaluatedModel>(
      EvaluateAgain(problem_, std::move(best->model)));
  step.parameters = EstimatesOf(*model_, {best->effect.effect.get()});
  explain_the_same_[best->effect.name()] = {name};
  EndAt(model_, &step);
  diagnosis_.steps.push_back(std::move(step));
  diagnosis_.final_verdict = Judge(*model_, nullptr);
  return true;
}

EvaluatedModel Search::Without(const std::string& name,
                               const EvaluatedModel& model) {
  Report("leaving out " + name, model.train_error());
  EvaluatedModel without =
      EvaluateWithout(problem_, model, name,
                      TrialOptions(problem_.options, model.train_error()));
  tried_.push_back(ErrorsOf(without));
  return without;
}

bool Search::WasTriedWithout(const std::string& name,
                             const EvaluatedModel& model) const {
  ModelComparison around;
  SetNeighbours(tried_, model, &around);
  return std::any_of(
      around.left_out.begin(), around.left_out.end(),
      [&](const ModelErrors& errors) { return errors.change == name; });
}

bool Search::TakeOutUnneeded() {
  bool any = false, again = true;
  while (again) {
    const std::vector<std::shared_ptr<const Effect>> effects = now().added;
    again = std::any_of(effects.rbegin(), effects.rend(), [&](const auto& e) {
      return !settled_.contains(e->name()) &&
             (TakeOutIfUnneeded(e->name()) || TakePartOf(*e));
    });
    any = any || again;
  }
  return any;
}

bool Search::TakeOutIfUnneeded(const std::string& name) {
  if (WasTriedWithout(name, now())) return false;
  EvaluatedModel without = Without(name, now());
  if (!IsNoWorse(without, now())) return false;
  TakeSimpler(name, nullptr, std::move(without));
  return true;
}

bool Search::TakePartOf(const Effect& whole) {
  for (const auto& part : candidates_) {
    if (!IsPartOf(*part, whole)) continue;
    Report(part->name() + " in the place of " + whole.name(),
           now().train_error());
    EvaluatedModel with_part =
        EvaluateWithPart(problem_, now(), whole.name(), part,
                         TrialOptions(problem_.options, now().train_error()));
    if (!IsNoWorse(with_part, now())) continue;
    TakeSimpler(whole.name(), part.get(), std::move(with_part));
    return true;
  }
  return false;
}

void Search::TakeSimpler(const std::string& name, const Effect* part,
                         EvaluatedModel simpler) {
  DiagnosisStep step = StepFrom(now());
  step.removed = name;
  step.predicted = simpler.train_error();
  model_ = std::make_shared<EvaluatedModel>(
      EvaluateAgain(problem_, std::move(simpler)));
  if (part != nullptr) {
    step.effects = {part->name()};
    step.indistinguishable_from = {{}};
    step.parameters = EstimatesOf(*model_, {part});
  }
  EndAt(model_, &step);
  diagnosis_.steps.push_back(std::move(step));
}

std::string Search::Chance(const EvaluatedModel& evaluated) {
  if (IsAtNoiseFloor(evaluated)) return "";
  Report("significance of the effects", evaluated.train_error());
  return LikeliestChance(problem_, evaluated, FitToWholeRuns(evaluated),
                         candidates_.size());
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
