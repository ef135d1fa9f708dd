#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "sysid/diagnosis/base_fit.h"
#include "sysid/diagnosis/equation_look.h"
#include "sysid/diagnosis/first_sets.h"
#include "sysid/diagnosis/rivals.h"
#include "sysid/diagnosis/search.h"

// The part of the search that adds effects together, before it goes on one by
// one: what the equations of motion show, and drives that nobody recorded.

namespace sysid {
namespace {

// What a model that has an effect says of it.
Confirmation ConfirmedBy(const EvaluatedModel& model, const Effect& effect) {
  Confirmation confirmed;
  confirmed.train = model.train_error();
  confirmed.holdout = model.holdout_error();
  confirmed.cv = model.cv;
  confirmed.segment_s = model.fit.segment_s;
  for (const auto& other : model.added) {
    if (other->name() == effect.name()) continue;
    confirmed.together_with.push_back(other->name());
  }
  confirmed.accepted = true;
  confirmed.parameters = EstimatesOf(model, {&effect});
  return confirmed;
}

}  // namespace

bool Search::BeginByEquations() {
  doing_ = "looking at the equations of motion";
  EquationLook look = LookByEquations(problem_, candidates_);
  followed_ = look.followed;
  diagnosis_.tests = look.tests;
  if (look.effects.size() <= size_t{kMostEffectsBySegments}) {
    shown_ = std::move(look.effects);
    return false;
  }
  diagnosis_.base = EvaluateAtStart(problem_);
  Report("what the equations of motion show", diagnosis_.base.train_error());
  const auto model = FitByEquations(problem_, diagnosis_.base, &look.effects);
  if (!std::isfinite(model->train_error()) ||
      !std::isfinite(model->holdout_error())) {
    return false;
  }
  // A fit of the motion would make up by all that is free for what follows
  // another joint and no candidate describes.
  by_equations_ =
      !followed_.empty() || FitsTakeMinutes(model->problem->model());
  if (!by_equations_) *model = EvaluateAgain(problem_, std::move(*model));
  for (const ScreenedEffect& effect : look.effects) {
    settled_.insert(effect.name());
  }
  Take(std::move(look.effects), model);
  return true;
}

void Search::AddDrives() {
  std::vector<ScreenedEffect> drives =
      DrivesWithoutEffort(problem_, candidates_);
  if (drives.empty() || IsAtNoiseFloor(diagnosis_.base)) return;
  Report("drives of commanded joints", diagnosis_.base.train_error());
  std::vector<const ScreenedEffect*> shown;
  for (const ScreenedEffect& drive : drives) shown.push_back(&drive);
  auto model = std::make_shared<EvaluatedModel>(EvaluateAgain(
      problem_, EvaluateByEquations(problem_, diagnosis_.base, shown)));
  if (!std::isfinite(model->train_error()) ||
      !ExplainsMost(problem_, diagnosis_.base, *model)) {
    return;
  }
  been_.insert(EffectsOf(diagnosis_.base));
  Take(std::move(drives), std::move(model));
}

void Search::AddTogether() {
  if (shown_.size() < 2 || IsAtNoiseFloor(diagnosis_.base)) return;
  Report("what the equations of motion show", diagnosis_.base.train_error());
  std::vector<const ScreenedEffect*> shown;
  for (const ScreenedEffect& effect : shown_) shown.push_back(&effect);
  const auto explains = [&](const EvaluatedModel& model) {
    return !IsDoubtful(model.fit) && WhyImplausible(model).empty() &&
           ExplainsMost(problem_, diagnosis_.base, model);
  };
  // What they leave is not known before: with the steps of the smallest error.
  auto model = std::make_shared<EvaluatedModel>(EvaluateWith(
      problem_, diagnosis_.base, shown, TrialOptions(problem_.options, 0.0)));
  if (!explains(*model)) {
    // What the base made of its parameters for want of them may be too far off:
    // from where the equations of motion have them all.
    do {
      model = FitByEquations(problem_, diagnosis_.base, &shown_);
      *model = EvaluateAgain(problem_, std::move(*model));
    } while (DropAtBound(*model, &shown_));
    if (shown_.empty() || !explains(*model)) return;
  }
  been_.insert(EffectsOf(diagnosis_.base));
  *model = EvaluateAgain(problem_, std::move(*model));
  tried_.push_back(ErrorsOf(*model));
  Take(std::move(shown_), std::move(model));
  if (LookBack({}, true)) LookBack({}, true);
  FoldRemovals();
  ListTogether();
}

void Search::ListTogether() {
  std::vector<CandidateEffect> taken = std::move(diagnosis_.candidates);
  diagnosis_.candidates.clear();
  diagnosis_.proposed.clear();
  // Nothing was missing together: the first look at one by one lists them.
  if (now().added.empty()) return;
  const Screening screening = Screen(diagnosis_.base);
  diagnosis_.tests = std::max(diagnosis_.tests, screening.tests);
  std::set<std::string> listed;
  const auto list = [&](CandidateEffect candidate) {
    if (listed.insert(candidate.screened.name()).second) {
      diagnosis_.candidates.push_back(std::move(candidate));
    }
  };
  for (const auto& effect : now().added) {
    diagnosis_.proposed.push_back(effect->name());
    const auto known =
        std::find_if(taken.begin(), taken.end(), [&](const auto& candidate) {
          return candidate.screened.name() == effect->name();
        });
    ScreenedEffect screened;
    screened.effect = effect;
    const int at = screening.IndexOf(effect->name());
    if (known != taken.end()) {
      screened = known->screened;
    } else if (at >= 0) {
      screened = screening.effects[at];
    }
    list({screened, ConfirmedBy(now(), *effect), {}, "", {}});
  }
  for (CandidateEffect& candidate : ListCandidates(screening, {}, -1)) {
    list(std::move(candidate));
  }
}

void Search::ListWhatStayed() {
  std::vector<CandidateEffect>& candidates = diagnosis_.candidates;
  const std::set<std::string> stayed = EffectsOf(*model_);
  std::map<std::string, std::string> gone;  // and why
  for (const DiagnosisStep& step : diagnosis_.steps) {
    if (step.removed.empty() || stayed.contains(step.removed)) continue;
    gone[step.removed] =
        step.effects.empty()
            ? "taken out again in a later step"
            : "replaced by " + step.effects[0] + " in a later step";
  }
  for (CandidateEffect& candidate : candidates) {
    const auto is_gone = [&](const std::string& name) {
      return gone.contains(name);
    };
    // It may have been of one that is gone.
    if (std::erase_if(candidate.indistinguishable_from, is_gone) > 0) {
      candidate.told_apart_by.clear();
    }
    const auto why = gone.find(candidate.screened.name());
    if (why == gone.end() || !candidate.confirmed) continue;
    candidate.confirmed->accepted = false;
    candidate.confirmed->refused = why->second;
  }
  auto next = candidates.begin();
  for (const auto& effect : model_->added) {
    const auto at = std::find_if(
        next, candidates.end(), [&](const CandidateEffect& candidate) {
          return candidate.screened.name() == effect->name();
        });
    if (at == candidates.end()) continue;
    if (!at->confirmed || !at->confirmed->accepted) {
      at->confirmed = ConfirmedBy(*model_, *effect);
    }
    AddNames(AlternativesTo(effect->name(), diagnosis_.steps),
             &at->indistinguishable_from);
    if (at->told_apart_by.empty() && !at->indistinguishable_from.empty()) {
      const auto other = std::find_if(
          candidates_.begin(), candidates_.end(), [&](const auto& candidate) {
            return candidate->name() == at->indistinguishable_from[0];
          });
      if (other != candidates_.end()) {
        at->told_apart_by = ToldApartBy(*effect, **other);
      }
    }
    std::rotate(next, at, at + 1);
    ++next;
  }
}

void Search::Take(std::vector<ScreenedEffect> effects,
                  std::shared_ptr<EvaluatedModel> model) {
  DiagnosisStep step = StepFrom(diagnosis_.base);
  step.predicted = model->train_error();
  for (ScreenedEffect& effect : effects) {
    effect.predicted_error = model->train_error();
    step.effects.push_back(effect.name());
    step.indistinguishable_from.emplace_back();
    CandidateEffect candidate{
        effect, ConfirmedBy(*model, *effect.effect), {}, "", {}};
    for (const ParameterEstimate& p : candidate.confirmed->parameters) {
      step.parameters.push_back(p);
    }
    diagnosis_.candidates.push_back(std::move(candidate));
  }
  diagnosis_.proposed = step.effects;
  diagnosis_.verdict = Verdict::kMissingEffect;
  if (!options_.add) return;
  EndAt(model, &step);
  diagnosis_.steps.push_back(std::move(step));
  model_ = std::move(model);
}

}  // namespace sysid
