#include "sysid/diagnosis/diagnose.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <string>

#include "models/error.h"
#include "sysid/diagnosis/base_fit.h"
#include "sysid/diagnosis/candidate_forces.h"
#include "sysid/diagnosis/equation_look.h"
#include "sysid/diagnosis/longer_segments.h"
#include "sysid/diagnosis/rivals.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/segmentation.h"

namespace sysid {
namespace {

constexpr double kSignificant = 0.01;  // of a p-value, which pays for all tests
constexpr size_t kMostExchanged = 2;
constexpr int kMostCompared = 12;  // candidates whose forces are shown
// An effect that explains less of the excess over the noise is not what is
// missing.
constexpr double kExplains = 0.2;

std::set<std::string> EffectsOf(const EvaluatedModel& evaluated) {
  std::set<std::string> names;
  for (const auto& effect : evaluated.added) names.insert(effect->name());
  return names;
}

class Search {
 public:
  Search(const DiagnosisProblem& problem,
         const std::vector<std::shared_ptr<const Effect>>& candidates,
         const DiagnosisOptions& options)
      : problem_(problem),
        candidates_(candidates),
        options_(options),
        refits_(problem, candidates) {}

  Diagnosis Run();

 private:
  void Report(const std::string& doing, double error);
  ReportDoing Reporting() {
    return [this](const std::string& doing, double error) {
      Report(doing, error);
    };
  }
  void SearchOn(Diagnosis* diagnosis);
  std::shared_ptr<EvaluatedModel> AddByEquations(Diagnosis* diagnosis);
  void KeepEvaluated(Diagnosis* diagnosis) const;
  Screening Screen(const EvaluatedModel& evaluated);
  bool LookBack(const std::vector<std::string>& newest,
                std::shared_ptr<EvaluatedModel>* model,
                std::vector<DiagnosisStep>* steps);
  std::string Chance(const EvaluatedModel& evaluated);
  bool TakeOutChance(std::shared_ptr<EvaluatedModel>* model,
                     std::vector<DiagnosisStep>* steps);
  bool WasHere(const EvaluatedModel& evaluated) const {
    return been_.contains(EffectsOf(evaluated));
  }
  Verdict Decide(const EvaluatedModel& evaluated,
                 const CandidateRefit* best) const;
  bool ExplainsMost(const EvaluatedModel& base,
                    const EvaluatedModel& found) const;

  const DiagnosisProblem& problem_;
  const std::vector<std::shared_ptr<const Effect>>& candidates_;
  const DiagnosisOptions& options_;
  const Refitter refits_;
  // Every model that the search has come from, by its effects: what led on from
  // there is no reason to go back, or it would go round.
  std::set<std::set<std::string>> been_;
  // What the equations of motion showed, and looked back at: by name.
  std::set<std::string> settled_;
  std::vector<FollowedMotion> followed_;
  std::string doing_;  // as Report() heard last
};

void Search::Report(const std::string& doing, double error) {
  ThrowIfCancelled(problem_.options.stop);
  doing_ = doing;
  if (problem_.options.progress) {
    problem_.options.progress({doing, 0, 0, error});
  }
}

Screening Search::Screen(const EvaluatedModel& evaluated) {
  Report("screening effects", evaluated.train_error());
  // Parameters that ran away for want of an effect are no place to look from:
  // from where they started.
  const Fit from = IsDoubtful(evaluated.fit)
                       ? StatesAtStart(*evaluated.problem, evaluated.fit.point)
                       : evaluated.fit;
  const LinearizedFit linearized(*evaluated.problem, from.point);
  if (!linearized.Valid()) return {};
  return ScreenEffects(linearized, from.model, candidates_, problem_.known);
}

// A step from a model, and its end at another.
DiagnosisStep StepFrom(const EvaluatedModel& before) {
  DiagnosisStep step;
  step.segment_s = before.fit.segment_s;
  step.train_before = before.train_error();
  step.holdout_before = before.holdout_error();
  return step;
}

void EndAt(std::shared_ptr<const EvaluatedModel> after, DiagnosisStep* step) {
  step->train_after = after->train_error();
  step->holdout_after = after->holdout_error();
  step->after = std::move(after);
}

// Takes out what the newest effects made useless, and exchanges what another
// candidate now does better. True where it made another model.
bool Search::LookBack(const std::vector<std::string>& newest,
                      std::shared_ptr<EvaluatedModel>* model,
                      std::vector<DiagnosisStep>* steps) {
  bool any = false;
  std::vector<std::string> older;
  for (const auto& effect : (*model)->added) {
    if (std::find(newest.begin(), newest.end(), effect->name()) ==
            newest.end() &&
        !settled_.contains(effect->name())) {
      older.push_back(effect->name());
    }
  }
  for (const std::string& name : older) {
    const EvaluatedModel* now = model->get();
    Report("looking back at " + name, now->train_error());
    EstimationOptions options = Coarse(problem_.options, now->train_error());
    options.progress = nullptr;
    options.max_iterations = kRefitIterations;
    EvaluatedModel without = EvaluateWithout(problem_, *now, name, options);
    if (!std::isfinite(without.train_error())) continue;
    DiagnosisStep step = StepFrom(*now);
    step.removed = name;
    const bool needed = WasHere(without) || !WhyImplausible(without).empty() ||
                        IsWorse(without.cv, now->cv);
    if (!needed) {
      step.predicted = without.train_error();
      *model = std::make_shared<EvaluatedModel>(std::move(without));
    } else {
      const Screening screening = Screen(without);
      std::vector<CandidateRefit> refits = ProposeEffects(screening);
      const int own = screening.IndexOf(name);
      std::erase_if(refits, [&](const CandidateRefit& refit) {
        return refit.effects[0] == own;
      });
      if (refits.size() > kMostExchanged) refits.resize(kMostExchanged);
      refits_.Confirm(without, &refits);
      std::vector<std::string> alternatives;
      for (const CandidateRefit& refit : refits) {
        if (own < 0 || !refit.accepted()) continue;
        if (StandFor(screening, own, refit.effects[0], *now, *refit.after)) {
          alternatives.push_back(refit.expected[0].name());
        }
      }
      const int best = refits_.Choose(refits);
      if (best < 0 || WasHere(*refits[best].after) ||
          !refits_.IsBetter(*refits[best].after, *now)) {
        AddAlternatives(name, alternatives, steps);
        continue;
      }
      const ScreenedEffect& effect = refits[best].expected[0];
      // The one that goes then stands for the one that comes.
      if (std::erase(alternatives, effect.name()) > 0) {
        alternatives.push_back(name);
      }
      step.effects = {effect.name()};
      step.indistinguishable_from = {alternatives};
      step.predicted = refits[best].predicted;
      step.parameters = EstimatesOf(*refits[best].after, {effect.effect.get()});
      *model = std::make_shared<EvaluatedModel>(std::move(*refits[best].after));
    }
    if (!(*model)->fit.converged) {
      **model = EvaluateAgain(problem_, std::move(**model));
    }
    EndAt(*model, &step);
    steps->push_back(step);
    any = true;
  }
  return any;
}

std::string Search::Chance(const EvaluatedModel& evaluated) {
  if (IsAtNoiseFloor(evaluated)) return "";
  Report("significance of the effects", evaluated.train_error());
  return LikeliestChance(problem_, evaluated, candidates_.size());
}

// Takes out, one after another, what may be no more than chance beside what is
// still missing. The search itself adds it all the same: until all that is
// missing is in the model, that is no random force. True where it took any.
bool Search::TakeOutChance(std::shared_ptr<EvaluatedModel>* model,
                           std::vector<DiagnosisStep>* steps) {
  bool any = false;
  for (;; any = true) {
    const EvaluatedModel& now = **model;
    DiagnosisStep step = StepFrom(now);
    step.removed = Chance(now);
    if (step.removed.empty()) return any;
    EstimationOptions options = problem_.options;
    options.progress = nullptr;
    *model = std::make_shared<EvaluatedModel>(
        EvaluateWithout(problem_, now, step.removed, options));
    step.predicted = (*model)->train_error();
    EndAt(*model, &step);
    steps->push_back(std::move(step));
  }
}

Verdict Search::Decide(const EvaluatedModel& evaluated,
                       const CandidateRefit* best) const {
  if (best != nullptr) {
    const double holdout = evaluated.holdout_error();
    const double excess = holdout * holdout - 1.0;
    const double left = std::pow(best->after->holdout_error(), 2) - 1.0;
    if (IsAtNoiseFloor(*best->after) || excess - left > kExplains * excess) {
      return Verdict::kMissingEffect;
    }
  }
  return IsAtNoiseFloor(evaluated) ? Verdict::kAdequate : Verdict::kUnexplained;
}

// Whether the found model accounts for most of what the given one misses of
// unseen data, over the same segments: (7.14). Else what is missing is
// something that no candidate is, and each of them stands in for a part of it.
bool Search::ExplainsMost(const EvaluatedModel& base,
                          const EvaluatedModel& found) const {
  constexpr double kMost = 0.75;  // of the excess: half of the error
  const double before = base.cv.error();
  const double after = EvaluateOver(problem_, found, base).cv.error();
  return after * after - 1.0 < (1.0 - kMost) * (before * before - 1.0);
}

// What a search that was stopped may still say. The model of the last step is
// whole: a later one was in the making.
void Search::KeepEvaluated(Diagnosis* diagnosis) const {
  diagnosis->interrupted = doing_;
  diagnosis->doubts.insert(
      diagnosis->doubts.begin(),
      "interrupted while " + doing_ + ": the search is not complete");
  if (diagnosis->candidates.empty()) {
    diagnosis->verdict = Decide(diagnosis->base, nullptr);
  }
  if (!diagnosis->steps.empty()) {
    diagnosis->final = diagnosis->steps.back().after;
  }
  diagnosis->final_verdict = Decide(diagnosis->last(), nullptr);
  diagnosis->where = {};
  diagnosis->where.channels = diagnosis->base.fit.train.channels;
  diagnosis->where.segments = diagnosis->base.fit.train.segments;
}

Diagnosis Search::Run() {
  Diagnosis diagnosis(problem_.model);
  doing_ = "fitting the model as given";
  diagnosis.base = EvaluateGiven(problem_);
  try {
    ShortenSegments(problem_, &diagnosis);
    AddDoubts(&diagnosis);
    if (!diagnosis.usable) {
      diagnosis.verdict = diagnosis.final_verdict = Verdict::kUnexplained;
      diagnosis.where.channels = diagnosis.base.fit.train.channels;
      diagnosis.where.segments = diagnosis.base.fit.train.segments;
      return diagnosis;
    }
    SearchOn(&diagnosis);
  } catch (const Cancelled&) {
    if (!options_.keep_evaluated) throw;
    KeepEvaluated(&diagnosis);
  }
  return diagnosis;
}

// Where more effects are missing than a search adds one by one, it would judge
// each while the others still are. The equations of motion, in which each is a
// column, name them together. Null where they show fewer, which segments judge
// better than differentiated positions, or where the motion is not predicted
// better.
std::shared_ptr<EvaluatedModel> Search::AddByEquations(Diagnosis* diagnosis) {
  const EvaluatedModel& base = diagnosis->base;
  if (IsAtNoiseFloor(base)) return nullptr;
  Report("equations of motion", base.train_error());
  EquationLook look = LookByEquations(problem_, base.fit.model, candidates_);
  followed_ = look.followed;
  if (look.effects.size() <= size_t{kMostEffectsBySegments}) return nullptr;
  Report("what the equations of motion show", base.train_error());
  std::shared_ptr<EvaluatedModel> model;
  // Without those that end at a bound: no more than a column that helped.
  for (bool whole = false; !whole;) {
    std::vector<const ScreenedEffect*> shown;
    for (const ScreenedEffect& effect : look.effects) shown.push_back(&effect);
    model = std::make_shared<EvaluatedModel>(
        EvaluateByEquations(problem_, base, shown));
    std::set<std::string> bound;
    for (const ParameterEstimate& p : model->fit.parameters) {
      if (p.at_bound) bound.insert(p.name);
    }
    whole =
        0 == std::erase_if(look.effects, [&](const ScreenedEffect& effect) {
          const std::vector<std::string> own = effect.effect->ParameterNames();
          return std::any_of(
              own.begin(), own.end(),
              [&](const std::string& name) { return bound.contains(name); });
        });
  }
  // What follows the motion of another joint no candidate describes. A fit of
  // the motion would make up for it by all that is free, as the encoder's noise
  // weighs it: the values stay those of the equations.
  if (followed_.empty()) *model = EvaluateAgain(problem_, std::move(*model));
  if (!(model->train_error() < base.train_error()) ||
      !(model->holdout_error() < base.holdout_error())) {
    return nullptr;
  }
  DiagnosisStep step = StepFrom(base);
  step.predicted = model->train_error();
  for (ScreenedEffect& effect : look.effects) {
    effect.predicted_error = model->train_error();
    step.effects.push_back(effect.name());
    step.indistinguishable_from.emplace_back();
    CandidateEffect candidate{effect, Confirmation{}, {}, "", {}};
    candidate.confirmed->train = model->train_error();
    candidate.confirmed->holdout = model->holdout_error();
    candidate.confirmed->accepted = true;
    candidate.confirmed->parameters =
        EstimatesOf(*model, {effect.effect.get()});
    for (const ParameterEstimate& p : candidate.confirmed->parameters) {
      step.parameters.push_back(p);
    }
    diagnosis->candidates.push_back(std::move(candidate));
    settled_.insert(effect.name());
  }
  diagnosis->tests = look.tests;
  diagnosis->proposed = step.effects;
  diagnosis->verdict = Verdict::kMissingEffect;
  EndAt(model, &step);
  diagnosis->steps.push_back(std::move(step));
  return model;
}

void Search::SearchOn(Diagnosis* result) {
  Diagnosis& diagnosis = *result;
  EvaluatedModel* now = &diagnosis.base;
  // The base in longer segments, or with what was added.
  std::shared_ptr<EvaluatedModel> model;
  if (options_.add) {
    model = AddByEquations(result);
    if (model != nullptr) now = model.get();
  }
  bool joined = false;  // whether `now` was
  // What the catalogue lacks would be taken for what is in it.
  const bool ends = model != nullptr && !followed_.empty();
  if (ends) diagnosis.final_verdict = Decide(*now, nullptr);
  diagnosis.by_equations = ends;
  for (int step = 0; !ends && step < kMostEffectsBySegments;) {
    been_.insert(EffectsOf(*now));
    const Screening screening = Screen(*now);
    std::vector<CandidateRefit> refits = ProposeEffects(screening);
    refits_.Confirm(*now, &refits);
    int best = refits_.Choose(refits);
    if (best < 0 || Decide(*now, &refits[best]) != Verdict::kMissingEffect) {
      std::vector<CandidateRefit> pairs = ProposePairs(screening);
      refits_.Confirm(*now, &pairs);
      const int pair = refits_.Choose(pairs);
      if (pair >= 0 &&
          (best < 0 || Decide(*now, &pairs[pair]) == Verdict::kMissingEffect)) {
        best = static_cast<int>(refits.size());
        refits.push_back(std::move(pairs[pair]));
      }
    }
    if (best >= 0) {
      refits_.AddRivals(screening, *now, best, &refits);
      best = refits_.Choose(refits);
    }
    if (best >= 0 && !options_.add && !Chance(*refits[best].after).empty()) {
      refits[best].refused =
          "a random force like what is still missing may make it up";
      best = -1;
    }
    const CandidateRefit* found = best >= 0 ? &refits[best] : nullptr;
    const std::vector<CandidateEffect> candidates =
        ListCandidates(screening, refits, best);
    if (diagnosis.candidates.empty() ||
        (found != nullptr && diagnosis.steps.empty())) {
      diagnosis.candidates = candidates;
      diagnosis.tests = screening.tests;
      diagnosis.verdict = Decide(*now, found);
      diagnosis.proposed.clear();
      if (found != nullptr) {
        for (const ScreenedEffect& effect : found->expected) {
          diagnosis.proposed.push_back(effect.name());
        }
      }
    }
    diagnosis.final_verdict = Decide(*now, found);
    if (found == nullptr) {
      if (!joined) {
        joined = true;  // once for each model
        if (std::optional<EvaluatedModel> next =
                FromWholeRuns(problem_, *now, Reporting())) {
          *now = std::move(*next);
          if (!diagnosis.steps.empty()) EndAt(model, &diagnosis.steps.back());
          diagnosis.final_verdict = Decide(*now, nullptr);
          continue;
        }
      }
      // What is too small for a segment adds up over a longer one. So does what
      // no candidate describes: not of motion that the given model follows for
      // no longer.
      constexpr double kRegular = 0.6;
      const bool regular = now->fit.segment_s >= kRegular * kLongestLength;
      const bool better = !diagnosis.steps.empty() && !IsAtNoiseFloor(*now);
      if (!regular && !better) break;
      std::optional<EvaluatedModel> next =
          Lengthen(problem_, *now, Reporting());
      if (!next) break;
      model = std::make_shared<EvaluatedModel>(std::move(*next));
      now = model.get();
      continue;
    }
    if (!options_.add) break;
    joined = false;
    CandidateRefit& chosen = refits[best];
    DiagnosisStep added = StepFrom(*now);
    std::vector<const Effect*> effects;
    for (size_t k = 0; k < chosen.effects.size(); ++k) {
      effects.push_back(chosen.expected[k].effect.get());
      added.effects.push_back(chosen.expected[k].name());
      // The chosen are the first of the list.
      added.indistinguishable_from.push_back(
          candidates[k].indistinguishable_from);
    }
    added.predicted = chosen.predicted;
    model = std::make_shared<EvaluatedModel>(std::move(*chosen.after));
    if (!model->fit.converged)
      *model = EvaluateAgain(problem_, std::move(*model));
    added.parameters = EstimatesOf(*model, effects);
    EndAt(model, &added);
    diagnosis.steps.push_back(added);
    // A better model can be followed for longer, and what is needed shows
    // there: the newest too.
    std::vector<std::string> newest = added.effects;
    std::optional<EvaluatedModel> next;
    if (!IsAtNoiseFloor(*model)) next = Lengthen(problem_, *model, Reporting());
    if (next) {
      model = std::make_shared<EvaluatedModel>(std::move(*next));
      newest.clear();
    }
    // What was exchanged changes what the newest is good for.
    if (LookBack(newest, &model, &diagnosis.steps)) {
      LookBack({}, &model, &diagnosis.steps);
    }
    now = model.get();
    if (++step == kMostEffectsBySegments)
      diagnosis.final_verdict = Decide(*now, nullptr);
  }
  if (!diagnosis.steps.empty()) {
    if (!ends && TakeOutChance(&model, &diagnosis.steps)) {
      diagnosis.final_verdict = Decide(*model, nullptr);
    }
    diagnosis.final = model;
    // What the first step could not see the later ones did; or took back.
    if (diagnosis.final_verdict == Verdict::kAdequate) {
      diagnosis.verdict = Verdict::kMissingEffect;
    } else if (model->added.empty()) {
      diagnosis.verdict = Decide(diagnosis.base, nullptr);
      diagnosis.proposed.clear();
    } else if (!ends && !ExplainsMost(diagnosis.base, *model)) {
      diagnosis.verdict = Verdict::kUnexplained;
    }
  }
  FindRivals(candidates_, result);
  Report("where it fails", diagnosis.base.train_error());
  diagnosis.where = FindWhere(diagnosis.base);
  diagnosis.where.followed = followed_;
  AddForcesToCompare(diagnosis.base, kMostCompared, &diagnosis.where.force,
                     &diagnosis.candidates);
}

}  // namespace

std::string ToString(Verdict verdict) {
  switch (verdict) {
    case Verdict::kAdequate:
      return "adequate";
    case Verdict::kMissingEffect:
      return "missing_effect";
    case Verdict::kUndecided:
      return "undecided";
    case Verdict::kUnexplained:
      return "unexplained";
  }
  return "";
}

std::vector<std::string> Diagnosis::added() const {
  std::vector<std::string> names;
  for (const auto& effect : last().added) names.push_back(effect->name());
  return names;
}

Diagnosis Diagnose(const DiagnosisProblem& problem,
                   const std::vector<std::shared_ptr<const Effect>>& candidates,
                   const DiagnosisOptions& options) {
  return Search(problem, candidates, options).Run();
}

}  // namespace sysid
