#include "sysid/diagnosis/search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "models/error.h"
#include "sysid/diagnosis/base_fit.h"
#include "sysid/diagnosis/candidate_forces.h"
#include "sysid/diagnosis/rivals.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/segmentation.h"

namespace sysid {
namespace {

constexpr int kMostCompared = 12;  // candidates whose forces are shown

// Without a missing force, for a base that was not looked at.
Where NowhereOf(const EvaluatedModel& base) {
  Where where;
  where.channels = base.fit.train.channels;
  where.segments = base.fit.train.segments;
  return where;
}

}  // namespace

DiagnosisStep StepFrom(const EvaluatedModel& before) {
  DiagnosisStep step;
  step.segment_s = before.fit.segment_s;
  step.train_before = before.train_error();
  step.holdout_before = before.holdout_error();
  step.cv_before = before.cv;
  return step;
}

std::set<std::string> EffectsOf(const EvaluatedModel& evaluated) {
  std::set<std::string> names;
  for (const auto& effect : evaluated.added) names.insert(effect->name());
  return names;
}

void EndAt(std::shared_ptr<const EvaluatedModel> after, DiagnosisStep* step) {
  step->train_after = after->train_error();
  step->holdout_after = after->holdout_error();
  step->after = std::move(after);
}

void Search::Report(const std::string& doing, double error) {
  ThrowIfCancelled(problem_.options.stop);
  doing_ = doing;
  if (problem_.options.progress) {
    problem_.options.progress({doing, 0, 0, error});
  }
}

ReportDoing Search::Reporting() {
  return
      [this](const std::string& doing, double error) { Report(doing, error); };
}

bool Search::WasHere(const EvaluatedModel& evaluated) const {
  return been_.contains(EffectsOf(evaluated));
}

Diagnosis Search::Run() {
  if (!BeginByEquations()) {
    doing_ = "fitting the model as given";
    diagnosis_.base = EvaluateGiven(problem_);
  }
  try {
    if (settled_.empty()) {
      ShortenSegments(problem_, &diagnosis_);
      AddDoubts(&diagnosis_);
    }
    if (diagnosis_.usable) {
      RunFromBase();
    } else {
      diagnosis_.verdict = diagnosis_.final_verdict = Verdict::kUnexplained;
      diagnosis_.where = NowhereOf(diagnosis_.base);
      diagnosis_.comparison.path = {ErrorsOf(diagnosis_.base)};
    }
  } catch (const Cancelled&) {
    if (!options_.keep_evaluated) throw;
    Keep();
  }
  return std::move(diagnosis_);
}

void Search::RunFromBase() {
  // What the catalogue lacks would be taken for what is in it.
  diagnosis_.by_equations = by_equations_;
  if (settled_.empty() || (options_.add && !by_equations_)) {
    if (options_.add) AddDrives();
    if (options_.add) AddTogether();
    AddOneByOne();
  } else {
    diagnosis_.final_verdict = Judge(now(), nullptr);
  }
  if (!diagnosis_.steps.empty()) Conclude();
  FindRivals(candidates_, &diagnosis_);
  CompareModels();
  Report("where it fails", diagnosis_.base.train_error());
  diagnosis_.where = FindWhere(diagnosis_.base);
  diagnosis_.where.followed = followed_;
  AddForcesToCompare(diagnosis_.base, kMostCompared, &diagnosis_.where.force,
                     &diagnosis_.candidates);
}

void Search::AddOneByOne() {
  bool joined = false;  // whether now() was
  for (int step = 0; step < kMostEffectsBySegments;) {
    been_.insert(EffectsOf(now()));
    Found found = Find();
    std::vector<CandidateEffect> listed =
        ListCandidates(found.screening, found.refits, found.best);
    if (found.best >= 0) {
      const std::string& name = listed[0].screened.name();
      std::vector<std::string>& same = explain_the_same_[name];
      same = ThatExplainTheSame(found.screening, found.refits, found.best);
      if (!options_.add && !same.empty()) {
        AddNames(NamesOf(AsGoodInstead(*found.get()->after, name, same, false)),
                 &listed[0].indistinguishable_from);
      }
    }
    Note(&found, listed);
    if (found.best < 0) {
      if (std::exchange(exchange_due_, false) && LookBack({}, true)) continue;
      if (!LookFarther(&joined)) return;
      continue;
    }
    if (!options_.add) return;
    joined = false;
    Add(found.get(), listed);
    ++step;
  }
  diagnosis_.final_verdict = Judge(now(), nullptr);
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

Search::Found Search::Find() {
  Found found{Screen(now()), {}, -1};
  std::vector<CandidateRefit>& refits = found.refits;
  refits = ProposeEffects(found.screening);
  refits_.Confirm(now(), &refits);
  for (const CandidateRefit& refit : refits) {
    tried_.push_back(ErrorsOf(*refit.after));
  }
  found.best = refits_.Choose(refits);
  if (found.best < 0 || Judge(now(), found.get()) != Verdict::kMissingEffect) {
    std::vector<CandidateRefit> pairs = ProposePairs(found.screening, refits);
    refits_.Confirm(now(), &pairs);
    const int pair = refits_.Choose(pairs);
    if (pair >= 0 && (found.best < 0 ||
                      Judge(now(), &pairs[pair]) == Verdict::kMissingEffect)) {
      found.best = static_cast<int>(refits.size());
      refits.push_back(std::move(pairs[pair]));
    }
  }
  const auto choose_among_rivals = [&] {
    refits_.AddRivals(found.screening, now(), found.best, &refits);
    found.best = refits_.Choose(refits);
  };
  if (found.best >= 0) choose_among_rivals();
  if (found.best >= 0 && !IsAtNoiseFloor(*found.get()->after)) {
    refits_.AddWholes(found.screening, now(), found.best, &refits);
    const int part = std::exchange(found.best, refits_.Choose(refits));
    if (found.best != part) choose_among_rivals();
  }
  if (found.best >= 0 && !options_.add &&
      !Chance(*found.get()->after).empty()) {
    found.get()->refused =
        "a random force as large as the remaining model error could explain "
        "the gain by chance";
    found.best = -1;
  }
  return found;
}

void Search::Note(Found* found, const std::vector<CandidateEffect>& listed) {
  const CandidateRefit* best = found->get();
  diagnosis_.final_verdict = Judge(now(), best);
  if (!diagnosis_.candidates.empty() &&
      (best == nullptr || !diagnosis_.steps.empty())) {
    return;
  }
  diagnosis_.candidates = listed;
  diagnosis_.tests = found->screening.tests;
  diagnosis_.verdict = diagnosis_.final_verdict;
  diagnosis_.proposed.clear();
  if (best == nullptr) return;
  for (const ScreenedEffect& effect : best->expected) {
    diagnosis_.proposed.push_back(effect.name());
  }
}

bool Search::LookFarther(bool* joined) {
  if (!*joined) {
    *joined = true;  // once for each model
    if (std::optional<EvaluatedModel> next =
            FromWholeRuns(problem_, now(), Reporting())) {
      now() = std::move(*next);
      if (!diagnosis_.steps.empty()) EndAt(model_, &diagnosis_.steps.back());
      diagnosis_.final_verdict = Judge(now(), nullptr);
      return true;
    }
  }
  // What is too small for a segment adds up over a longer one. So does what no
  // candidate describes: not of motion that the given model follows for no
  // longer.
  constexpr double kRegular = 0.6;
  const bool regular = now().fit.segment_s >= kRegular * kLongestLength;
  const bool better = !diagnosis_.steps.empty() && !IsAtNoiseFloor(now());
  if (!regular && !better) return false;
  std::optional<EvaluatedModel> next = Lengthen(problem_, now(), Reporting());
  if (!next) return false;
  model_ = std::make_shared<EvaluatedModel>(std::move(*next));
  return true;
}

void Search::Add(CandidateRefit* chosen,
                 const std::vector<CandidateEffect>& listed) {
  DiagnosisStep added = StepFrom(now());
  std::vector<const Effect*> effects;
  for (size_t k = 0; k < chosen->effects.size(); ++k) {
    effects.push_back(chosen->expected[k].effect.get());
    added.effects.push_back(chosen->expected[k].name());
    // The chosen are the first of the list.
    added.indistinguishable_from.push_back(listed[k].indistinguishable_from);
  }
  added.predicted = chosen->predicted;
  model_ = std::make_shared<EvaluatedModel>(
      EvaluateAgain(problem_, std::move(*chosen->after)));
  added.parameters = EstimatesOf(*model_, effects);
  EndAt(model_, &added);
  diagnosis_.steps.push_back(added);
  // A better model can be followed for longer, and what is needed shows there:
  // the newest too.
  std::vector<std::string> newest = added.effects;
  std::optional<EvaluatedModel> next;
  if (!IsAtNoiseFloor(*model_)) {
    next = Lengthen(problem_, *model_, Reporting());
  }
  if (next) {
    model_ = std::make_shared<EvaluatedModel>(std::move(*next));
    newest.clear();
  }
  // What was taken out changes what the newest is good for.
  if (LookBack(newest, false)) LookBack({}, false);
  exchange_due_ = true;
}

void Search::Conclude() {
  const bool by_equations = diagnosis_.by_equations;
  if (!by_equations) {
    const bool unneeded = TakeOutUnneeded();
    if (TakeOutChance() || unneeded) {
      diagnosis_.final_verdict = Judge(*model_, nullptr);
    }
  }
  do {
    while (options_.add && !by_equations && AddOverWholeRuns()) {
      diagnosis_.final_verdict = Judge(*model_, nullptr);
    }
  } while (AskAlternativesAgain());
  diagnosis_.final = model_;
  ListWhatStayed();
  // What the first step could not see the later ones did; or took back.
  const bool adequate = diagnosis_.final_verdict == Verdict::kAdequate;
  if (model_->added.empty()) {
    diagnosis_.verdict =
        adequate ? Verdict::kAdequate : Judge(diagnosis_.base, nullptr);
    diagnosis_.proposed.clear();
  } else if (adequate) {
    diagnosis_.verdict = Verdict::kMissingEffect;
  } else if (!by_equations) {
    // "Unexplained" where that is clear by a standard error.
    std::vector<ModelErrors>& path = diagnosis_.comparison.path;
    path = {ErrorsOver(problem_, diagnosis_.base, *model_)};
    diagnosis_.verdict = ExplainsMost(path[0].cv, model_->cv, 1.0)
                             ? Verdict::kMissingEffect
                             : Verdict::kUnexplained;
  }
}

void Search::CompareModels() {
  const EvaluatedModel& last = diagnosis_.last();
  ModelComparison& comparison = diagnosis_.comparison;
  Report("comparing the models", last.train_error());
  if (comparison.path.empty()) {  // else the verdict asked for it
    comparison.path = {ErrorsOver(problem_, diagnosis_.base, last)};
  }
  for (const DiagnosisStep& step : diagnosis_.steps) {
    comparison.path.push_back(ErrorsOver(problem_, *step.after, last));
  }
  // As it ended: perhaps fitted again in longer segments after its step.
  comparison.path.back() = ErrorsOf(last);
  for (const auto& effect : last.added) {
    if (settled_.contains(effect->name()) ||
        WasTriedWithout(effect->name(), last)) {
      continue;
    }
    Without(effect->name(), last);
  }
  SetNeighbours(tried_, last, &comparison);
}

// The model of the last step is whole: a later one was in the making.
void Search::Keep() {
  diagnosis_.interrupted = doing_;
  diagnosis_.doubts.insert(
      diagnosis_.doubts.begin(),
      "interrupted while " + doing_ + ": the search is not complete");
  if (diagnosis_.candidates.empty()) {
    diagnosis_.verdict = Judge(diagnosis_.base, nullptr);
  }
  if (!diagnosis_.steps.empty()) {
    diagnosis_.final = diagnosis_.steps.back().after;
  }
  diagnosis_.final_verdict = Judge(diagnosis_.last(), nullptr);
  diagnosis_.where = NowhereOf(diagnosis_.base);
  diagnosis_.comparison = {{ErrorsOf(diagnosis_.base)}, {}, {}};
  for (const DiagnosisStep& step : diagnosis_.steps) {
    diagnosis_.comparison.path.push_back(ErrorsOf(*step.after));
  }
}

}  // namespace sysid
