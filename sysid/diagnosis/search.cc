#include "sysid/diagnosis/search.h"

#include <algorithm>
#include <cmath>

#include "models/dynamics_tangent.h"
#include "models/error.h"
#include "sysid/diagnosis/base_fit.h"
#include "sysid/diagnosis/candidate_forces.h"
#include "sysid/diagnosis/equation_look.h"
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

// Drops the effects that ended at a bound: each is no more than a column that
// helped. True where there were any.
bool DropAtBound(const EvaluatedModel& model,
                 std::vector<ScreenedEffect>* effects) {
  std::set<std::string> bound;
  for (const ParameterEstimate& p : model.fit.parameters) {
    if (p.at_bound) bound.insert(p.name);
  }
  return 0 < std::erase_if(*effects, [&](const ScreenedEffect& effect) {
           const std::vector<std::string> own = effect.effect->ParameterNames();
           return std::any_of(
               own.begin(), own.end(),
               [&](const std::string& name) { return bound.contains(name); });
         });
}

// By Jets, or by the small steps of the smoothed friction of pairs, of a model
// with so many effects that the equations of motion begin its search.
bool FitsTakeMinutes(const Model& model) {
  const EffectSet& effects = model.effects();
  bool has_pairs = false;
  for (int i = 0; i < effects.size(); ++i) {
    has_pairs |= (effects.effect(i).hooks() & kPairHook) != 0;
  }
  return has_pairs || !DynamicsTangent::Covers(model);
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
  const auto model = ByEquations(&look.effects);
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
  Take(std::move(look.effects), std::move(model));
  return true;
}

std::shared_ptr<EvaluatedModel> Search::ByEquations(
    std::vector<ScreenedEffect>* effects) {
  std::shared_ptr<EvaluatedModel> model;
  do {
    std::vector<const ScreenedEffect*> all;
    for (const ScreenedEffect& effect : *effects) all.push_back(&effect);
    model = std::make_shared<EvaluatedModel>(
        EvaluateByEquations(problem_, diagnosis_.base, all));
  } while (DropAtBound(*model, effects));
  return model;
}

void Search::AddDrives() {
  std::vector<ScreenedEffect> drives;
  for (const auto& candidate : candidates_) {
    if (!(candidate->hooks() & kDriveHook)) continue;
    const Joint& joint = problem_.model.mechanism().joints[candidate->joint()];
    const auto is_driven = [&](const auto& one) {
      return !one->run.effort.col(joint.v_index).isZero(0.0);
    };
    const auto& runs = problem_.train->runs();
    if (problem_.model.effects().Contains(candidate->name()) ||
        std::any_of(runs.begin(), runs.end(), is_driven)) {
      continue;
    }
    drives.emplace_back().effect = candidate;
    // Nothing moves the joint without it: that needs no test.
    drives.back().p_value = std::nan("");
  }
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
      model = ByEquations(&shown_);
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
  // What was taken out again is not what is missing.
  const std::set<std::string> kept = EffectsOf(now());
  if (kept.empty()) return;
  std::stable_partition(
      diagnosis_.candidates.begin(), diagnosis_.candidates.end(),
      [&](const auto& c) { return kept.contains(c.screened.name()); });
  std::erase_if(diagnosis_.proposed,
                [&](const auto& name) { return !kept.contains(name); });
}

void Search::Take(std::vector<ScreenedEffect> effects,
                  std::shared_ptr<EvaluatedModel> model) {
  DiagnosisStep step = StepFrom(diagnosis_.base);
  step.predicted = model->train_error();
  for (ScreenedEffect& effect : effects) {
    effect.predicted_error = model->train_error();
    step.effects.push_back(effect.name());
    step.indistinguishable_from.emplace_back();
    CandidateEffect candidate{effect, Confirmation{}, {}, "", {}};
    candidate.confirmed->train = model->train_error();
    candidate.confirmed->holdout = model->holdout_error();
    candidate.confirmed->cv = model->cv;
    candidate.confirmed->accepted = true;
    candidate.confirmed->parameters =
        EstimatesOf(*model, {effect.effect.get()});
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
    std::vector<CandidateRefit> pairs = ProposePairs(found.screening);
    refits_.Confirm(now(), &pairs);
    const int pair = refits_.Choose(pairs);
    if (pair >= 0 && (found.best < 0 ||
                      Judge(now(), &pairs[pair]) == Verdict::kMissingEffect)) {
      found.best = static_cast<int>(refits.size());
      refits.push_back(std::move(pairs[pair]));
    }
  }
  if (found.best >= 0) {
    refits_.AddRivals(found.screening, now(), found.best, &refits);
    found.best = refits_.Choose(refits);
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
    diagnosis_.verdict = ExplainsMost(problem_, diagnosis_.base, *model_, 1.0)
                             ? Verdict::kMissingEffect
                             : Verdict::kUnexplained;
  }
}

void Search::CompareModels() {
  const EvaluatedModel& last = diagnosis_.last();
  ModelComparison& comparison = diagnosis_.comparison;
  Report("comparing the models", last.train_error());
  comparison.path = {ErrorsOver(problem_, diagnosis_.base, last)};
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
