#include "sysid/diagnosis/effect_search.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "sysid/diagnosis/first_sets.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/diagnosis/no_answer.h"
#include "sysid/diagnosis/verdict.h"

namespace sysid {
namespace {

bool HaveTheSameErrors(const FittedSet& a, const FittedSet& b) {
  const Eigen::ArrayXd of_a = LogErrorsWithData(a), of_b = LogErrorsWithData(b);
  return of_a.size() == of_b.size() && of_a.size() > 0 &&
         (of_a - of_b).abs().maxCoeff() < kSameError;
}

}  // namespace

EffectSearch::EffectSearch(const DiagnosisProblem& problem,
                           const Candidates& catalogue, ReportDoing report)
    : problem_(problem),
      catalogue_(catalogue),
      report_(std::move(report)),
      sets_(problem, catalogue),
      looks_(problem, catalogue, sets_) {}

void EffectSearch::Say(const std::string& what, const FittedSet& fitted) const {
  Log(what, catalogue_, fitted);
}

std::vector<std::shared_ptr<const Effect>> EffectSearch::EffectsOf(
    const std::vector<int>& effects) const {
  std::vector<std::shared_ptr<const Effect>> all;
  for (const int e : effects) all.push_back(catalogue_[e]);
  return all;
}

EvaluatedModel EffectSearch::Evaluate(const FittedSet& from,
                                      const ProposedSet& set, double enough,
                                      double error) const {
  std::string names;
  for (const int e : set.effects) {
    names += (names.empty() ? "" : ", ") + catalogue_[e]->name();
  }
  report_("fitting " + (names.empty() ? "the model as given" : names),
          from.model.train_error());
  // What stays begins where it ended; what goes takes its values along.
  std::map<std::string, double> values = ValuesOf(from.model);
  for (const auto& effect : from.model.added) {
    const bool stays = std::any_of(
        set.effects.begin(), set.effects.end(),
        [&](int e) { return catalogue_[e]->name() == effect->name(); });
    if (stays) continue;
    for (const std::string& name : effect->ParameterNames()) values.erase(name);
  }
  if (IsDoubtful(from.model.fit)) {
    for (const FreeParameter& free : problem_.free) {
      values.erase(free.parameter.name);
    }
  }
  std::set<std::string> without = set.without_influence;
  without.insert(from.model.without_influence.begin(),
                 from.model.without_influence.end());
  std::vector<std::map<std::string, double>> all;
  for (const auto& start : set.starts) {
    all.push_back(values);
    for (const auto& [name, value] : start) all.back()[name] = value;
  }
  if (all.empty()) all.push_back(values);
  return EvaluateFrom(problem_, from.model, EffectsOf(set.effects), without,
                      all, enough, TrialOptions(problem_.options, error));
}

std::shared_ptr<FittedSet> EffectSearch::FitFrom(const FittedSet& from,
                                                 const ProposedSet& set,
                                                 double enough, double error) {
  return sets_.Keep(set.effects, Evaluate(from, set, enough, error));
}

// Without what the data does not determine its error is about the same.
bool EffectSearch::MayBeBest(const FittedSet& fitted) const {
  const std::shared_ptr<FittedSet> best = sets_.Best();
  if (best == nullptr) return true;
  const int gone = static_cast<int>(
      catalogue_[*fitted.undetermined]->ParameterNames().size());
  ModelScore rest = fitted.score;
  rest.parameters = std::max(0, rest.parameters - gone);
  return !Beats(best->score, rest);
}

void EffectSearch::DropUndetermined(std::shared_ptr<FittedSet> fitted) {
  while (fitted->undetermined && MayBeBest(*fitted)) {
    std::vector<int> rest = fitted->effects;
    std::erase(rest, *fitted->undetermined);
    sets_.ForgetThatItWasBeaten(rest);
    if (sets_.Find(rest) != nullptr) break;
    fitted = FitWithout(*fitted, *fitted->undetermined);
  }
}

void EffectSearch::Fit(const ProposedSet& proposed) {
  // The first start alone is tried where it gains so much of what was promised.
  constexpr double kOfPromise = 0.5;
  const FittedSet& from = *proposed.from;
  const double now = std::exp(LogErrorsWithData(from).mean());
  const double left = std::min(1.0, std::pow(proposed.error / now, 2));
  const std::shared_ptr<FittedSet> fitted =
      FitFrom(from, proposed,
              (1.0 - kOfPromise * (1.0 - left)) * from.model.fit.train.squares,
              std::max(1.0, proposed.error));
  looks_.Learn(proposed, *fitted);
  char text[60];
  std::snprintf(text, sizeof(text), "fit (%.2f predicted)", proposed.error);
  Say(text, *fitted);
  DropUndetermined(fitted);
}

void EffectSearch::LookFrom(const std::shared_ptr<FittedSet>& at) {
  if (looks_.WasMadeFrom(*at)) return;
  report_("looking for what is missing", at->model.train_error());
  looks_.From(at);
}

bool EffectSearch::Improve() {
  const std::shared_ptr<FittedSet> best = sets_.Best();
  if (best == nullptr) return false;
  LookFrom(best);
  for (; fits_ < most_fits_ && failures_ < kMostFailures; ++failures_) {
    const std::optional<ProposedSet> next = looks_.Next(*best);
    if (!next) break;
    Fit(*next);
    ++fits_;
    if (sets_.Best() != best) {
      failures_ = 0;
      return true;
    }
  }
  return FitToTheEnd(best);
}

bool EffectSearch::FitToTheEnd(const std::shared_ptr<FittedSet>& best) {
  if (best->is_final) return false;
  best->is_final = true;
  std::shared_ptr<FittedSet> now = best;
  if (!best->effects.empty()) {
    now = sets_.Keep(best->effects, EvaluateAgain(problem_, best->model));
    now->is_final = true;
    Say("to the end", *now);
  }
  // Its states may be caught in wrong ones.
  if (auto joined = FromWholeRuns(problem_, now->model, report_)) {
    now = sets_.Keep(best->effects, std::move(*joined));
    now->is_final = true;
    Say("from whole runs", *now);
  }
  const std::shared_ptr<FittedSet> after = sets_.Best();
  return after != nullptr && (after->effects != best->effects ||
                              Matters(after->score, best->score));
}

std::shared_ptr<FittedSet> EffectSearch::FitWithout(const FittedSet& from,
                                                    int effect) {
  std::vector<int> rest = from.effects;
  std::erase(rest, effect);
  if (auto known = sets_.Find(rest)) return known;
  const auto fitted = FitFrom(from, ProposedSet{rest, 0, {}, {}, nullptr, 0.0},
                              0.0, std::max(1.0, from.error()));
  Say("without " + catalogue_[effect]->name(), *fitted);
  return fitted;
}

void EffectSearch::LeaveOutEach() {
  for (auto best = sets_.Best(); best != nullptr && best->effects.size() > 1;) {
    for (const int e : best->effects) FitWithout(*best, e);
    const auto now = sets_.Best();
    if (now == best || now->score.parameters >= best->score.parameters) return;
    best = now;
  }
}

void EffectSearch::FitRivals(const FittedSet& best) {
  // Those with fewer parameters first: one of them would be the better answer.
  size_t fitted = 0;
  for (const ProposedSet& alike : looks_.AlikeTo(best)) {
    if (sets_.Find(alike.effects) != nullptr) continue;
    if (fitted++ == kMostRivalsFitted) break;
    // Where it was as good, and from there as far as the best was followed.
    auto model = LengthenTo(
        problem_, best.model.fit.segment_s,
        Evaluate(*alike.from, alike, 0.0, std::max(1.0, alike.error)));
    if (!model) continue;
    Say("as good", *sets_.Keep(alike.effects, std::move(*model)));
  }
}

void EffectSearch::FitOtherNames() {
  const std::shared_ptr<FittedSet> best = sets_.Best();
  if (best == nullptr || best->effects.empty()) return;
  LookFrom(best);
  std::vector<ProposedSet> names = looks_.SameForceAs(*best);
  if (names.size() > kMostRivalsFitted) names.resize(kMostRivalsFitted);
  for (const ProposedSet& set : names) {
    if (sets_.Find(set.effects) != nullptr) continue;
    Say("another name",
        *FitFrom(*best, set, 0.0, std::max(1.0, best->error())));
  }
  if (const auto now = sets_.Best(); now != best) LookFrom(now);
}

void EffectSearch::GoOnWith(const FittedSet& best, EvaluatedModel longer) {
  sets_.GoOnWith(best);
  looks_.GoOn();
  fits_ = failures_ = 0;
  const auto kept = sets_.Keep(best.effects, std::move(longer));
  Say("longer", *kept);
  DropUndetermined(kept);
}

std::optional<EvaluatedModel> EffectSearch::GivenOverHalf(
    const EvaluatedModel& now) const {
  constexpr double kShortest = 0.1;  // s
  if (problem_.options.segment > 0.0) return std::nullopt;
  DiagnosisProblem shorter = problem_;
  const double length = now.fit.segment_s;
  shorter.options.segment = std::max(kShortest, 0.5 * length);
  EvaluatedModel given = EvaluateGiven(shorter);
  if (!std::isfinite(given.cv.error()) ||
      IsAsLong(given.fit.segment_s, length)) {
    return std::nullopt;
  }
  given.problem = std::make_shared<const ShootingProblem>(
      given.problem->With(Coarse(problem_.options, given.train_error())));
  return given;
}

EvaluatedModel EffectSearch::FitGiven() const {
  report_("fitting the model as given", std::nan(""));
  EvaluatedModel given = EvaluateGiven(problem_);
  // Over a motion that it does not follow nothing is linear: shorter, as long
  // as that helps. What does not move at all for want of a drive is no matter
  // of length.
  if (!DrivesWithoutEffort(problem_, catalogue_).empty()) return given;
  while (!Follows(given)) {
    auto shorter = GivenOverHalf(given);
    if (!shorter) break;
    given = std::move(*shorter);
  }
  return given;
}

void EffectSearch::LookOverShorter() {
  std::optional<FittedSets> before;  // what was fitted over the first segments
  for (std::shared_ptr<FittedSet> at = base_; at == sets_.Best();) {
    if (at->score.at_noise || Improve()) return;
    auto shorter = GivenOverHalf(at->model);
    if (!shorter) break;
    if (!before) before.emplace(sets_);
    sets_.GoOnWith(*at);
    looks_.Clear();
    fits_ = failures_ = 0;
    at = sets_.Keep({}, std::move(*shorter));
    Say("shorter", *at);
    if (at->score.at_noise) break;
  }
  const auto best = sets_.Best();
  if (!before || best == nullptr || !best->effects.empty()) return;
  // Nothing was found: on with the first segments, where all fits were made.
  sets_.Restore(*before);
  looks_.Clear();
  fits_ = most_fits_;
}

bool EffectSearch::RefuseChance() {
  bool any = false;
  for (auto best = sets_.Best(); best != nullptr && !best->effects.empty();
       best = sets_.Best()) {
    if (best->score.at_noise) break;
    report_("significance of the effects", best->model.train_error());
    const std::string name =
        LikeliestChance(problem_, best->model, catalogue_.size());
    if (name.empty()) break;
    const int effect =
        *std::find_if(best->effects.begin(), best->effects.end(),
                      [&](int e) { return catalogue_[e]->name() == name; });
    sets_.RefuseAsChance(effect, *best);
    Say("chance", *best);
    any = true;
    DropUndetermined(FitWithout(*best, effect));
    if (sets_.Best() == nullptr) {
      FitFrom(*best, ProposedSet{}, 0.0, std::max(1.0, best->error()));
    }
  }
  return any;
}

std::vector<int> EffectSearch::IndicesOf(
    const std::vector<ScreenedEffect>& effects) const {
  std::vector<int> indices;
  for (const ScreenedEffect& effect : effects) {
    const auto at = std::find_if(
        catalogue_.begin(), catalogue_.end(),
        [&](const auto& one) { return one->name() == effect.name(); });
    indices.push_back(static_cast<int>(at - catalogue_.begin()));
  }
  std::sort(indices.begin(), indices.end());
  return indices;
}

bool EffectSearch::BeginByEquations(Equations equations) {
  report_("looking at the equations of motion", std::nan(""));
  by_equations_ =
      known_look_ ? *known_look_ : LookAtEquations(problem_, catalogue_);
  std::vector<ScreenedEffect>& shown = by_equations_.effects;
  if (!by_equations_.is_arm) return false;
  if (equations == Equations::kBegin) {
    shown.clear();
    return false;
  }
  // No fit would follow the motion of a model that misses so much: what the
  // equations of motion say is the answer, and its values are theirs.
  report_("fitting the equations of motion", std::nan(""));
  std::vector<ScreenedEffect> nothing;
  DiagnosisProblem arm = problem_;
  AddWhatArmsHave(by_equations_, arm.model, &arm.free, &arm.options);
  DiagnosisProblem given = arm;
  given.free = problem_.free;
  base_ = sets_.Keep({}, EstimateByEquations(given, &nothing));
  Say("base", *base_);
  EvaluatedModel model = EstimateByEquations(arm, &shown);
  if (!shown.empty()) {
    found_by_equations_ = sets_.Keep(IndicesOf(shown), std::move(model));
  } else {
    found_by_equations_ = std::make_shared<FittedSet>(*base_);
    found_by_equations_->model = std::move(model);
  }
  Say("by the equations of motion", *found_by_equations_);
  return true;
}

void EffectSearch::FitFirstSets() {
  if (IsAtNoiseFloor(base_->model)) return;
  const std::vector<ScreenedEffect> drives =
      DrivesWithoutEffort(problem_, catalogue_);
  if (!drives.empty()) {
    report_("drives of commanded joints", base_->model.train_error());
    EvaluatedModel model = EvaluateAgain(
        problem_, EvaluateByEquations(problem_, base_->model, drives));
    if (std::isfinite(model.train_error())) {
      assumed_ = IndicesOf(drives);
      Say("drives", *sets_.Keep(assumed_, std::move(model)));
    }
  }
  std::vector<ScreenedEffect> shown = by_equations_.effects;
  if (shown.size() < 2) return;
  report_("what the equations of motion show", base_->model.train_error());
  // What the base made of its parameters for want of them may be too far off:
  // from where the equations of motion have them all.
  const auto model = FitByEquations(problem_, base_->model, &shown);
  if (shown.empty()) return;
  const auto again =
      sets_.Keep(IndicesOf(shown), EvaluateAgain(problem_, *model));
  Say("by the equations of motion", *again);
  DropUndetermined(again);
}

void EffectSearch::ImproveAndLengthen() {
  // What explains most of what the base misses can be followed for longer, and
  // what else is needed shows there; before that longer segments only make what
  // is missing less linear. What is at the noise is asked there first.
  bool explains = false;
  for (bool improved = true; improved;) {
    std::shared_ptr<FittedSet> best = sets_.Best();
    if (best == nullptr) break;
    improved = !best->score.at_noise && Improve();
    best = sets_.Best();
    if (best == nullptr) break;
    looks_.NoteAlike(*best);
    if (const auto base = sets_.Find({})) {
      explains = ExplainsMost(base->model.cv, best->model.cv);
    }
    if (improved && !explains && !best->score.at_noise) continue;
    if (!best->model.fit.converged) {
      FitToTheEnd(best);
      best = sets_.Best();
      if (best == nullptr) break;
    }
    if (auto longer = Lengthen(problem_, best->model, report_)) {
      GoOnWith(*best, std::move(*longer));
      improved = true;
    }
  }
}

EffectSearch::Answer EffectSearch::Run(const std::vector<int>& start,
                                       Equations equations, int most_fits) {
  most_fits_ = most_fits;
  if (BeginByEquations(equations)) return Judged();
  base_ = sets_.Keep({}, FitGiven());
  Say("base", *base_);
  FitFirstSets();
  if (!start.empty()) {
    const std::shared_ptr<FittedSet> from =
        FitFrom(*base_, ProposedSet{start, 0, {}, {}, nullptr, 0.0}, 0.0, 1.0);
    Say("start", *from);
    if (from->IsAnswer()) sets_.Remove({});
  }
  LookOverShorter();
  ImproveAndLengthen();
  LeaveOutEach();
  if (RefuseChance()) {
    // What a random force could make up is no candidate any more.
    fits_ = failures_ = 0;
    ImproveAndLengthen();
    LeaveOutEach();
    RefuseChance();
  }
  if (const std::shared_ptr<FittedSet> best = sets_.Best();
      best != nullptr && !best->effects.empty()) {
    if (looks_.AlikeTo(*best).empty()) {
      // What was known before was proposed by no look.
      LookFrom(base_);
      looks_.NoteAlike(*best);
    }
    FitRivals(*best);
    if (sets_.Best() != best) LeaveOutEach();
  }
  FitOtherNames();
  return Judged();
}

EffectSearch::Answer EffectSearch::Judged() const {
  Answer answer = SoFar();
  answer.explains = Explains(problem_, answer);
  return answer;
}

bool EffectSearch::Explains(const DiagnosisProblem& problem,
                            const Answer& answer) {
  const EvaluatedModel& base = answer.base->model;
  const FittedSet& found = *answer.found;
  if (answer.by_equations) return ExplainsMostEffort(base.fit, found.model.fit);
  // Above the noise a fit that ended before its minimum explains nothing.
  return answer.at_noise ||
         (!found.effects.empty() && found.model.fit.converged &&
          ExplainsMost(problem, base, found.model, 1.0));
}

EffectSearch::Answer EffectSearch::SoFar() const {
  Answer answer;
  answer.base = base_;
  const std::shared_ptr<FittedSet> best = sets_.Best();
  answer.found = best != nullptr ? best : base_;
  answer.look = by_equations_;
  answer.assumed = assumed_;
  if (found_by_equations_ != nullptr) {
    answer.found = found_by_equations_;
    answer.by_equations = true;
    answer.order = IndicesOf(by_equations_.effects);
    answer.fitted = sets_.All();
    return answer;
  }
  const FittedSet& found = *answer.found;
  if (!found.effects.empty()) {
    answer.rivals = sets_.RivalsOf(found);
    for (const auto& rival : answer.rivals) {
      if (looks_.IsSameForce(found, rival->effects) ||
          HaveTheSameErrors(*rival, found)) {
        answer.same_force.insert(rival->effects);
      }
    }
  }
  answer.explains = answer.at_noise = found.score.at_noise;
  answer.usable = base_->model.fit.converged ||
                  (base_->model.fit.iterations > 0 &&
                   std::isfinite(base_->model.train_error()) &&
                   std::isfinite(base_->model.holdout_error()));
  // By the error without each.
  std::map<int, double> without;
  for (const int e : found.effects) {
    std::vector<int> rest = found.effects;
    rest.erase(std::find(rest.begin(), rest.end(), e));
    const auto at = sets_.Find(rest);
    without[e] = at != nullptr ? at->error() : 0.0;
  }
  answer.order = found.effects;
  std::stable_sort(answer.order.begin(), answer.order.end(),
                   [&](int a, int b) { return without[a] > without[b]; });
  answer.fitted = sets_.All();
  return answer;
}

}  // namespace sysid
