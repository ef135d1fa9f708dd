#include "sysid/diagnosis/effect_search.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <tuple>
#include <utility>

#include "glog/logging.h"
#include "sysid/diagnosis/comparison.h"
#include "sysid/diagnosis/first_sets.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/diagnosis/no_answer.h"
#include "sysid/diagnosis/verdict.h"
#include "sysid/unexplained_force/discrepancy.h"

namespace sysid {
namespace {

using Eigen::ArrayXd;

// Of the stretches that have data, as LinearSets has them.
ArrayXd WithData(const FittedSet& fitted) {
  ArrayXd some(fitted.score.log_errors.size());
  Eigen::Index n = 0;
  for (const double log : fitted.score.log_errors) {
    if (!std::isnan(log)) some[n++] = log;
  }
  return some.head(n);
}

int CountParameters(const EvaluatedModel& model) {
  int count = 0;
  for (const auto& effect : model.added) {
    for (const std::string& name : effect->ParameterNames()) {
      if (!model.without_influence.contains(name)) ++count;
    }
  }
  return count;
}

// Of items in the order of their numbers of parameters, those with the fewest
// that no other item beats; where each is beaten by some other, all.
template <typename Item>
std::vector<Item> FewestUnbeaten(const std::vector<Item>& items) {
  std::vector<Item> unbeaten;
  for (const Item& item : items) {
    if (!unbeaten.empty() &&
        item.score.parameters > unbeaten.front().score.parameters) {
      break;
    }
    const bool beaten =
        std::any_of(items.begin(), items.end(), [&](const Item& other) {
          return &other != &item && Beats(other.score, item.score);
        });
    if (!beaten) unbeaten.push_back(item);
  }
  return unbeaten.empty() ? items : unbeaten;
}

std::set<int> Minus(const std::vector<int>& a, const std::vector<int>& b) {
  std::set<int> rest;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(),
                      std::inserter(rest, rest.end()));
  return rest;
}

size_t Distance(const std::vector<int>& a, const std::vector<int>& b) {
  return Minus(a, b).size() + Minus(b, a).size();
}

}  // namespace

ModelScore ScoreOf(const EvaluatedModel& model) {
  ModelScore score;
  if (std::isfinite(model.cv.error())) score.log_errors = model.cv.LogErrors();
  score.parameters = CountParameters(model);
  score.at_noise = IsAtNoiseFloor(model);
  return score;
}

EffectSearch::EffectSearch(const DiagnosisProblem& problem,
                           const Candidates& catalogue, ReportDoing report)
    : problem_(problem), catalogue_(catalogue), report_(std::move(report)) {
  for (const std::string& kind : Catalogue().kinds()) {
    ranks_.emplace(kind, static_cast<int>(ranks_.size()));
  }
}

void EffectSearch::Say(const std::string& what, const FittedSet& fitted) const {
  if (!VLOG_IS_ON(1)) return;
  std::string names;
  for (const int e : fitted.effects) names += " " + catalogue_[e]->name();
  char text[200];
  std::snprintf(
      text, sizeof(text),
      ": error %.3f, train %.3f, held out %.3f, %.2f s, %d parameters",
      fitted.error(), fitted.model.train_error(), fitted.model.holdout_error(),
      fitted.model.fit.segment_s, fitted.score.parameters);
  VLOG(1) << what << names << text
          << (fitted.refused.empty() ? "" : "; refused: " + fitted.refused)
          << (fitted.model.fit.converged ? "" : "; not converged");
}

EffectSearch::Commonness EffectSearch::Rank(
    const std::vector<int>& effects) const {
  Commonness rank;
  for (const int e : effects) {
    const auto at = ranks_.find(catalogue_[e]->kind());
    rank.first +=
        static_cast<int>(at != ranks_.end() ? at->second : ranks_.size());
    rank.second.push_back(catalogue_[e]->name());
  }
  std::sort(rank.second.begin(), rank.second.end());
  return rank;
}

std::vector<std::shared_ptr<const Effect>> EffectSearch::EffectsOf(
    const std::vector<int>& effects) const {
  std::vector<std::shared_ptr<const Effect>> all;
  for (const int e : effects) all.push_back(catalogue_[e]);
  return all;
}

EffectSearch::Fitted EffectSearch::Keep(std::vector<int> effects,
                                        EvaluatedModel model) {
  auto fitted = std::make_shared<FittedSet>(
      FittedSet{std::move(effects), std::move(model), {}, "", {}, {}, false});
  fitted->score = ScoreOf(fitted->model);
  if (!std::isfinite(fitted->error())) {
    fitted->refused = "the motion does not stay finite with it";
  }
  for (const int e : fitted->effects) {
    if (!fitted->refused.empty()) break;
    fitted->refused = WhyImplausible(fitted->model, *catalogue_[e]);
    if (!fitted->refused.empty()) fitted->implausible = e;
  }
  if (fitted->refused.empty()) {
    double most = kByChance;
    for (const int e : fitted->effects) {
      const double p =
          PValueOf(*catalogue_[e], problem_.model, fitted->model.fit);
      if (!(p > most)) continue;
      most = p;
      fitted->undetermined = e;
    }
    if (fitted->undetermined) {
      fitted->refused = "this data does not determine " +
                        catalogue_[*fitted->undetermined]->name();
    }
  }
  RefuseMadeUp(fitted.get());
  Fitted& at = store_[fitted->effects];
  // The same set may have been fitted from elsewhere: as it did best.
  if (at == nullptr || !at->IsAnswer() ||
      (fitted->IsAnswer() && fitted->error() < at->error())) {
    at = fitted;
  }
  return fitted;
}

EffectSearch::Fitted EffectSearch::Best() const {
  struct Item {
    ModelScore score;
    Fitted fitted;
  };
  std::vector<Item> items;
  for (const auto& [effects, fitted] : store_) {
    if (!fitted->IsAnswer() || IsBeaten(*fitted)) continue;
    items.push_back({fitted->score, fitted});
  }
  std::stable_sort(items.begin(), items.end(),
                   [](const auto& a, const auto& b) {
                     return std::pair(a.score.parameters, a.fitted->error()) <
                            std::pair(b.score.parameters, b.fitted->error());
                   });
  if (items.empty()) return nullptr;
  const std::vector<Item> unbeaten = FewestUnbeaten(items);
  const auto least = std::min_element(
      unbeaten.begin(), unbeaten.end(), [](const auto& a, const auto& b) {
        return a.fitted->error() < b.fitted->error();
      });
  // Of those that are as good, the most common laws.
  Fitted best = least->fitted;
  for (const Item& item : unbeaten) {
    const ErrorDifference by =
        DifferenceOf(item.score.log_errors, least->score.log_errors);
    if (by.mean <= std::max(by.std_error, kSameError) &&
        Rank(item.fitted->effects) < Rank(best->effects)) {
      best = item.fitted;
    }
  }
  return best;
}

bool EffectSearch::IsBeaten(const FittedSet& fitted) const {
  const auto by = beaten_by_.find(fitted.effects);
  if (by == beaten_by_.end()) return false;
  const auto at = store_.find(by->second);
  return at != store_.end() && at->second->IsAnswer() &&
         !Matters(fitted.score, at->second->score);
}

void EffectSearch::GoOnWith(const FittedSet& best, EvaluatedModel longer) {
  for (const auto& [effects, fitted] : store_) {
    if (effects == best.effects) continue;
    // Those with fewer parameters were beaten by some, or they were the best.
    if (!fitted->IsAnswer() ||
        fitted->score.parameters < best.score.parameters ||
        Beats(best.score, fitted->score)) {
      beaten_by_[effects] = best.effects;
    }
  }
  const std::vector<int> effects = best.effects;
  beaten_by_.erase(effects);
  store_.clear();
  tried_.clear();
  looks_.clear();
  fits_ = failures_ = 0;
  const Fitted kept = Keep(effects, std::move(longer));
  Say("longer", *kept);
  DropUndetermined(kept);
}

bool EffectSearch::WasLookedFrom(const FittedSet& at) const {
  return std::any_of(looks_.begin(), looks_.end(), [&](const Look& look) {
    return look.at->effects == at.effects && !Matters(at.score, look.at->score);
  });
}

void EffectSearch::LookFrom(const Fitted& at) {
  report_("looking for what is missing", at->model.train_error());
  Look look{at, nullptr, {}, {}};
  look.sets = std::make_unique<LinearSets>(problem_, at->model, catalogue_);
  if (look.sets->Valid()) look.predicted = SearchSets(*look.sets);
  Say("look at " + std::to_string(look.predicted.size()) + " sets from", *at);
  for (size_t i = 0; i < look.predicted.size() && VLOG_IS_ON(2); ++i) {
    if (i == 20) break;
    std::string names;
    for (const int e : look.predicted[i].score.effects) {
      names += " " + catalogue_[e]->name();
    }
    VLOG(2) << "  " << std::exp(look.predicted[i].mean) << " "
            << look.predicted[i].score.parameters << names;
  }
  looks_.push_back(std::move(look));
}

std::vector<EffectSearch::Prediction> EffectSearch::NearestPredictions() const {
  std::map<std::vector<int>, std::pair<size_t, Prediction>> nearest;
  for (size_t l = 0; l < looks_.size(); ++l) {
    const Look& look = looks_[l];
    const ArrayXd now = NowAt(look, *look.at).log_errors;
    for (const PredictedSet& one : look.predicted) {
      const std::vector<int>& effects = one.score.effects;
      if (tried_.contains({effects, look.at.get()}) ||
          std::any_of(effects.begin(), effects.end(),
                      [&](int e) { return chance_.contains(e); })) {
        continue;
      }
      ArrayXd logs = one.log_errors;
      for (const auto& [added, ratio] : look.refuted) {
        if (!std::includes(effects.begin(), effects.end(), added.begin(),
                           added.end())) {
          continue;
        }
        logs = logs.max((one.log_errors + ratio).min(now));
      }
      const auto known = store_.find(effects);
      if (known != store_.end() &&
          (effects == look.at->effects ||
           !(std::exp(logs.mean()) < kMuchLess * known->second->error()))) {
        continue;
      }
      // Of all looks the nearest one counts, the last of those.
      const size_t distance = Distance(effects, look.at->effects);
      const auto at = nearest.find(effects);
      if (at != nearest.end() && at->second.first < distance) continue;
      nearest.insert_or_assign(
          effects,
          std::pair(
              distance,
              Prediction{{std::move(logs), one.score.parameters}, l, &one}));
    }
  }
  std::vector<Prediction> all;
  for (auto& [effects, at] : nearest) all.push_back(std::move(at.second));
  return all;
}

ModelScore EffectSearch::NowAt(const Look& look, const FittedSet& fitted) {
  return {look.sets->LogErrors((2.0 * WithData(fitted)).exp().eval()),
          fitted.score.parameters};
}

bool EffectSearch::IsWanted(const Prediction& one, const ModelScore& now,
                            const FittedSet& best) const {
  if (one.score.parameters > now.parameters) {
    return Beats(one.score, now);
  }
  if (Beats(now, one.score)) return false;
  // As many parameters must do better; fewer are only asked for where the best
  // itself was linearised: what goes far is not predicted.
  if (one.score.parameters == now.parameters) {
    const ErrorDifference by =
        DifferenceOf(now.log_errors, one.score.log_errors);
    return by.mean > std::max(by.std_error, kLeastGain);
  }
  return looks_[one.look].at->effects == best.effects ||
         !Beats(now, one.score, 1.0);
}

std::optional<EffectSearch::Prediction> EffectSearch::NextProposal(
    const FittedSet& best) const {
  const auto is_less = [](const Prediction& a, const Prediction& b) {
    return a.mean() < b.mean();
  };
  std::vector<Prediction> wanted, others;
  for (Prediction& one : NearestPredictions()) {
    const std::vector<int>& effects = one.set->score.effects;
    const ModelScore now = NowAt(looks_[one.look], best);
    if (now.log_errors.size() != one.score.log_errors.size()) continue;
    if (beaten_by_.contains(effects) && !Matters(one.score, now)) continue;
    if (IsWanted(one, now, best)) {
      wanted.push_back(std::move(one));
    } else if (effects.size() <= std::max<size_t>(1, best.effects.size())) {
      others.push_back(std::move(one));
    }
  }
  if (wanted.empty()) {
    // While something is missing nothing is known better than by a fit: of the
    // sets with no more effects the best by its prediction.
    if (others.empty() || best.score.at_noise) return std::nullopt;
    return *std::min_element(others.begin(), others.end(), is_less);
  }
  const auto key = [](const Prediction& one) {
    return std::tuple(one.score.parameters, one.set->score.effects.size(),
                      one.mean());
  };
  std::stable_sort(
      wanted.begin(), wanted.end(),
      [&](const auto& a, const auto& b) { return key(a) < key(b); });
  const std::vector<Prediction> unbeaten = FewestUnbeaten(wanted);
  const auto least =
      std::min_element(unbeaten.begin(), unbeaten.end(), is_less);
  // Of the same force under two names the more common one.
  auto chosen = least;
  for (auto one = unbeaten.begin(); one != unbeaten.end(); ++one) {
    if (one->mean() < least->mean() + kSameError &&
        Rank(one->set->score.effects) < Rank(chosen->set->score.effects)) {
      chosen = one;
    }
  }
  return *chosen;
}

EffectSearch::Fitted EffectSearch::FitFrom(
    const FittedSet& from, std::vector<int> effects,
    const std::set<std::string>& without_influence,
    const std::vector<std::map<std::string, double>>& starts, double enough,
    double error) {
  std::string names;
  for (const int e : effects) {
    names += (names.empty() ? "" : ", ") + catalogue_[e]->name();
  }
  report_("fitting " + (names.empty() ? "the model as given" : names),
          from.model.train_error());
  // What stays begins where it ended; what goes takes its values along.
  std::map<std::string, double> values = ValuesOf(from.model);
  for (const auto& effect : from.model.added) {
    const bool stays = std::any_of(effects.begin(), effects.end(), [&](int e) {
      return catalogue_[e]->name() == effect->name();
    });
    if (stays) continue;
    for (const std::string& name : effect->ParameterNames()) values.erase(name);
  }
  if (IsDoubtful(from.model.fit)) {
    for (const FreeParameter& free : problem_.free) {
      values.erase(free.parameter.name);
    }
  }
  std::set<std::string> without = without_influence;
  without.insert(from.model.without_influence.begin(),
                 from.model.without_influence.end());
  std::vector<std::map<std::string, double>> all;
  for (const auto& start : starts) {
    all.push_back(values);
    for (const auto& [name, value] : start) all.back()[name] = value;
  }
  if (all.empty()) all.push_back(values);
  return Keep(effects,
              EvaluateFrom(problem_, from.model, EffectsOf(effects), without,
                           all, enough, TrialOptions(problem_.options, error)));
}

void EffectSearch::DropUndetermined(Fitted fitted) {
  while (fitted->undetermined) {
    std::vector<int> rest = fitted->effects;
    rest.erase(std::find(rest.begin(), rest.end(), *fitted->undetermined));
    beaten_by_.erase(rest);
    if (store_.contains(rest)) break;
    fitted =
        FitFrom(*fitted, rest, {}, {}, 0.0, std::max(1.0, fitted->error()));
    Say("without what is not determined", *fitted);
  }
}

// The whole joint step, less of it, and none: its first order may overshoot.
std::vector<std::map<std::string, double>> EffectSearch::StartsOf(
    const LinearSets& sets, const LinearSets::Score& score) {
  std::vector<std::map<std::string, double>> starts;
  for (const double part : {1.0, 0.3, 0.0}) {
    starts.push_back(sets.StartOf(score, part));
  }
  return starts;
}

void EffectSearch::Fit(const Prediction& proposal) {
  // The first start alone is tried where it gains so much of what was promised.
  constexpr double kOfPromise = 0.5;
  Look& look = looks_[proposal.look];
  const LinearSets::Score& score = proposal.set->score;
  const FittedSet& from = *look.at;
  tried_.insert({score.effects, &from});
  const double promised = std::exp(0.5 * score.squares.log().mean());
  const double now = std::exp(WithData(from).mean());
  const double left = std::min(1.0, std::pow(promised / now, 2));
  const Fitted fitted =
      FitFrom(from, score.effects, look.sets->WithoutInfluence(score),
              StartsOf(*look.sets, score),
              (1.0 - kOfPromise * (1.0 - left)) * from.model.fit.train.squares,
              std::max(1.0, promised));
  const double ratio = fitted->error() / promised;
  if (fitted->implausible) {
    look.refuted.push_back({{*fitted->implausible}, std::log(1e3)});
  } else if (!(ratio < kRefuted)) {
    std::set<int> added = Minus(score.effects, from.effects);
    if (added.empty()) added = {score.effects.begin(), score.effects.end()};
    look.refuted.push_back({added, std::log(std::min(ratio, 1e3))});
  }
  char text[60];
  std::snprintf(text, sizeof(text), "fit (%.2f predicted)", promised);
  Say(text, *fitted);
  DropUndetermined(fitted);
}

bool EffectSearch::Improve() {
  const Fitted best = Best();
  // Nothing has fewer parameters than one, and nothing is missing.
  if (best == nullptr ||
      (best->score.parameters <= 1 && best->score.at_noise)) {
    return false;
  }
  if (!WasLookedFrom(*best)) LookFrom(best);
  for (; fits_ < most_fits_ && failures_ < kMostFailures; ++failures_) {
    const std::optional<Prediction> next = NextProposal(*best);
    if (!next) break;
    Fit(*next);
    ++fits_;
    if (Best() != best) {
      failures_ = 0;
      return true;
    }
  }
  return FitToTheEnd(best);
}

bool EffectSearch::FitToTheEnd(const Fitted& best) {
  if (best->is_final) return false;
  best->is_final = true;
  Fitted now = best;
  if (!best->effects.empty()) {
    now = Keep(best->effects, EvaluateAgain(problem_, best->model));
    now->is_final = true;
    Say("to the end", *now);
  }
  // Its states may be caught in wrong ones.
  if (auto joined = FromWholeRuns(problem_, now->model, report_)) {
    now = Keep(best->effects, std::move(*joined));
    now->is_final = true;
    Say("from whole runs", *now);
  }
  const Fitted after = Best();
  return after != nullptr && (after->effects != best->effects ||
                              Matters(after->score, best->score));
}

void EffectSearch::LeaveOutEach() {
  for (Fitted best = Best(); best != nullptr && best->effects.size() > 1;) {
    for (const int e : best->effects) {
      std::vector<int> rest = best->effects;
      rest.erase(std::find(rest.begin(), rest.end(), e));
      if (store_.contains(rest)) continue;
      Say("without",
          *FitFrom(*best, rest, {}, {}, 0.0, std::max(1.0, best->error())));
    }
    const Fitted now = Best();
    if (now == best || now->score.parameters >= best->score.parameters) return;
    best = now;
  }
}

void EffectSearch::NoteAlike(const FittedSet& best) {
  auto& noted = alike_[best.effects];
  for (const Look& look : looks_) {
    const auto own = std::find_if(
        look.predicted.begin(), look.predicted.end(),
        [&](const auto& one) { return one.score.effects == best.effects; });
    if (own == look.predicted.end()) continue;
    const ArrayXd now = (2.0 * WithData(*look.at)).exp();
    const auto explained = [&](const PredictedSet& one) {
      return (now - one.score.squares).sum();
    };
    for (const PredictedSet& one : look.predicted) {
      if (one.score.effects == best.effects ||
          one.score.effects.size() > best.effects.size() ||
          one.score.parameters > best.score.parameters) {
        continue;
      }
      const ErrorDifference by = DifferenceOf(one.log_errors, own->log_errors);
      const bool near =
          by.mean <= std::max(std::min(by.std_error, kRivalFarOff),
                              std::log1p(kMatters)) ||
          explained(one) > kRivalExplains * explained(*own);
      const auto at = noted.find(one.score.effects);
      if (!near || (at != noted.end() && at->second.mean <= by.mean)) continue;
      noted.insert_or_assign(one.score.effects,
                             Alike{one.score.parameters, by.mean,
                                   look.sets->WithoutInfluence(one.score),
                                   StartsOf(*look.sets, one.score)});
    }
  }
}

void EffectSearch::FitRivals(const FittedSet& best) {
  // Those with fewer parameters first: one of them would be the better answer.
  std::vector<std::tuple<int, double, std::vector<int>>> order;
  for (const auto& [effects, alike] : alike_[best.effects]) {
    if (store_.contains(effects)) continue;
    order.emplace_back(alike.parameters, alike.mean, effects);
  }
  std::sort(order.begin(), order.end());
  if (order.size() > kMostRivalsFitted) order.resize(kMostRivalsFitted);
  for (const auto& [parameters, mean, effects] : order) {
    const Alike& alike = alike_[best.effects][effects];
    Say("as good", *FitFrom(best, effects, alike.without_influence,
                            alike.starts, 0.0, std::max(1.0, best.error())));
  }
}

std::vector<std::shared_ptr<const FittedSet>> EffectSearch::RivalsOf(
    const FittedSet& best) const {
  std::vector<std::shared_ptr<const FittedSet>> rivals;
  for (const auto& [effects, fitted] : store_) {
    if (!fitted->IsAnswer() || effects == best.effects ||
        fitted->score.parameters > best.score.parameters) {
      continue;
    }
    const ErrorDifference by =
        DifferenceOf(fitted->score.log_errors, best.score.log_errors);
    if (by.mean <= std::max(by.std_error, kSameError)) rivals.push_back(fitted);
  }
  return rivals;
}

EvaluatedModel EffectSearch::FitGiven() const {
  constexpr double kShortest = 0.1;  // s
  report_("fitting the model as given", std::nan(""));
  EvaluatedModel given = EvaluateGiven(problem_);
  // Over a motion that it does not follow nothing is linear: shorter, as long
  // as that helps. What does not move at all for want of a drive is no matter
  // of length.
  if (!DrivesWithoutEffort(problem_, catalogue_).empty()) return given;
  while (!Follows(given) && !(problem_.options.segment > 0.0)) {
    DiagnosisProblem shorter = problem_;
    const double length = given.fit.segment_s;
    shorter.options.segment = std::max(kShortest, 0.5 * length);
    EvaluatedModel next = EvaluateGiven(shorter);
    if (!std::isfinite(next.cv.error()) ||
        !(next.fit.segment_s < 0.9 * length)) {
      break;
    }
    given = std::move(next);
    given.problem = std::make_shared<const ShootingProblem>(
        given.problem->With(Coarse(problem_.options, given.train_error())));
  }
  return given;
}

void EffectSearch::RefuseMadeUp(FittedSet* fitted) const {
  for (const int e : fitted->effects) {
    if (!chance_.contains(e)) continue;
    fitted->refused =
        "a random force as large as the remaining error could make up " +
        catalogue_[e]->name();
  }
}

bool EffectSearch::RefuseChance() {
  const size_t before = chance_.size();
  for (Fitted best = Best(); best != nullptr && !best->effects.empty();
       best = Best()) {
    if (best->score.at_noise) break;
    report_("significance of the effects", best->model.train_error());
    const std::string name =
        LikeliestChance(problem_, best->model, catalogue_.size());
    if (name.empty()) break;
    const auto made_up = [&](int e) { return catalogue_[e]->name() == name; };
    chance_.insert(
        *std::find_if(best->effects.begin(), best->effects.end(), made_up));
    for (const auto& [effects, fitted] : store_) RefuseMadeUp(fitted.get());
    Say("chance", *best);
    std::vector<int> rest = best->effects;
    std::erase_if(rest, made_up);
    // What it beat is no better for that: what is left of it is.
    for (const auto& [effects, fitted] : store_) {
      if (effects != rest && Beats(best->score, fitted->score)) {
        beaten_by_[effects] = rest;
      }
    }
    if (!store_.contains(rest)) {
      DropUndetermined(
          FitFrom(*best, rest, {}, {}, 0.0, std::max(1.0, best->error())));
    }
    if (Best() == nullptr) {
      FitFrom(*best, {}, {}, {}, 0.0, std::max(1.0, best->error()));
    }
  }
  return chance_.size() > before;
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
      LookByEquations(ShootingProblem(problem_.model, problem_.free,
                                      problem_.train, problem_.options),
                      catalogue_, problem_.known);
  std::vector<ScreenedEffect>& shown = by_equations_.effects;
  if (shown.size() <= size_t{kMostEffectsBySegments}) return false;
  if (equations == Equations::kBegin) {
    shown.clear();
    return false;
  }
  EvaluatedModel base = EvaluateAtStart(problem_);
  report_("what the equations of motion show", base.train_error());
  std::shared_ptr<EvaluatedModel> model =
      FitByEquations(problem_, base, &shown);
  if (!std::isfinite(model->train_error()) ||
      !std::isfinite(model->holdout_error())) {
    return false;
  }
  // A fit of the motion would make up by all that is free for what follows
  // another joint and no candidate describes.
  base_is_fitted_ = false;
  values_by_equations_ = !by_equations_.followed.empty() ||
                         FitsTakeMinutes(model->problem->model());
  if (!values_by_equations_) *model = EvaluateAgain(problem_, *model);
  base_ = Keep({}, std::move(base));
  Say("base", *base_);
  Say("by the equations of motion", *Keep(IndicesOf(shown), *model));
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
      Say("drives", *Keep(assumed_, std::move(model)));
    }
  }
  std::vector<ScreenedEffect> shown = by_equations_.effects;
  if (shown.size() < 2) return;
  report_("what the equations of motion show", base_->model.train_error());
  const Fitted together =
      Keep(IndicesOf(shown), EvaluateWith(problem_, base_->model, shown,
                                          TrialOptions(problem_.options, 0.0)));
  Say("shown by the equations of motion", *together);
  if (together->IsAnswer() && !IsDoubtful(together->model.fit)) return;
  // What the base made of its parameters for want of them may be too far off:
  // from where the equations of motion have them all.
  const auto model = FitByEquations(problem_, base_->model, &shown);
  if (shown.empty()) return;
  Say("by the equations of motion",
      *Keep(IndicesOf(shown), EvaluateAgain(problem_, *model)));
}

void EffectSearch::ImproveAndLengthen() {
  // What explains most of what the base misses can be followed for longer, and
  // what else is needed shows there; before that longer segments only make what
  // is missing less linear. What is at the noise is asked there first.
  bool explains = false;
  for (bool improved = true; improved;) {
    Fitted best = Best();
    if (best == nullptr) break;
    improved = !best->score.at_noise && Improve();
    best = Best();
    if (best == nullptr) break;
    NoteAlike(*best);
    if (const auto base = store_.find({}); base != store_.end()) {
      explains = ExplainsMost(base->second->model.cv, best->model.cv);
    }
    if (improved && !explains && !best->score.at_noise) continue;
    if (!best->model.fit.converged) {
      FitToTheEnd(best);
      best = Best();
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
  base_ = Keep({}, FitGiven());
  Say("base", *base_);
  FitFirstSets();
  if (!start.empty()) {
    const Fitted from = FitFrom(*base_, start, {}, {}, 0.0, 1.0);
    Say("start", *from);
    if (from->IsAnswer()) store_.erase(std::vector<int>{});
  }
  ImproveAndLengthen();
  LeaveOutEach();
  if (RefuseChance()) {
    // What a random force could make up is no candidate any more.
    fits_ = failures_ = 0;
    ImproveAndLengthen();
    LeaveOutEach();
    RefuseChance();
  }
  if (const Fitted best = Best(); best != nullptr && !best->effects.empty()) {
    FitRivals(*best);
    if (Best() != best) LeaveOutEach();
  }
  return Judged();
}

EffectSearch::Answer EffectSearch::Judged() const {
  Answer answer = SoFar();
  const FittedSet& found = *answer.found;
  answer.explains = answer.at_noise ||
                    (!found.effects.empty() &&
                     ExplainsMost(problem_, base_->model, found.model, 1.0));
  return answer;
}

EffectSearch::Answer EffectSearch::SoFar() const {
  Answer answer;
  answer.base = base_;
  const Fitted best = Best();
  answer.found = best != nullptr ? best : base_;
  answer.by_equations = values_by_equations_;
  answer.followed = by_equations_.followed;
  answer.assumed = assumed_;
  const FittedSet& found = *answer.found;
  if (!found.effects.empty()) answer.rivals = RivalsOf(found);
  answer.explains = answer.at_noise = found.score.at_noise;
  answer.usable = base_->model.fit.converged ||
                  ((!base_is_fitted_ || base_->model.fit.iterations > 0) &&
                   std::isfinite(base_->model.train_error()) &&
                   std::isfinite(base_->model.holdout_error()));
  // By the error without each.
  std::map<int, double> without;
  for (const int e : found.effects) {
    std::vector<int> rest = found.effects;
    rest.erase(std::find(rest.begin(), rest.end(), e));
    const auto at = store_.find(rest);
    without[e] = at != store_.end() ? at->second->error() : 0.0;
  }
  answer.order = found.effects;
  std::stable_sort(answer.order.begin(), answer.order.end(),
                   [&](int a, int b) { return without[a] > without[b]; });
  for (const auto& [effects, fitted] : store_) answer.fitted.push_back(fitted);
  return answer;
}

}  // namespace sysid
