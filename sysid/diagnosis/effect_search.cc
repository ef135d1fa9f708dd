#include "sysid/diagnosis/effect_search.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <utility>

#include "glog/logging.h"
#include "sysid/diagnosis/comparison.h"
#include "sysid/diagnosis/discrepancy.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/diagnosis/verdict.h"

namespace sysid {
namespace {

using Eigen::ArrayXd;

// Those of the training runs that have data, as LinearSets has them.
ArrayXd OfFittedRuns(const FittedSet& fitted, Eigen::Index count) {
  ArrayXd some(count);
  Eigen::Index n = 0;
  for (Eigen::Index j = 0; j < fitted.log_errors.size() && n < count; ++j) {
    if (!std::isnan(fitted.log_errors[j])) some[n++] = fitted.log_errors[j];
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
std::vector<Item> FewestUnbeaten(std::vector<Item> items, double deviations) {
  std::vector<Item> unbeaten;
  for (const Item& item : items) {
    if (!unbeaten.empty() && item.parameters > unbeaten.front().parameters) {
      break;
    }
    const bool beaten =
        std::any_of(items.begin(), items.end(), [&](const Item& other) {
          return &other != &item &&
                 Beats(other.log_errors, item.log_errors, deviations);
        });
    if (!beaten) unbeaten.push_back(item);
  }
  return unbeaten.empty() ? items : unbeaten;
}

// Why a model is no answer; empty where it may be one.
std::string WhyNoAnswer(const DiagnosisProblem& problem,
                        const EvaluatedModel& model) {
  if (!std::isfinite(model.cv.error())) {
    return "the motion does not stay finite with it";
  }
  const std::string implausible = WhyImplausible(model);
  if (!implausible.empty()) return implausible;
  for (const auto& effect : model.added) {
    if (PValueOf(*effect, problem.model, model.fit) > kByChance) {
      return "this data does not determine " + effect->name();
    }
  }
  return "";
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

EffectSearch::EffectSearch(const DiagnosisProblem& problem,
                           const Candidates& catalogue, ReportDoing report)
    : problem_(problem),
      catalogue_(catalogue),
      report_(std::move(report)),
      deviations_(Deviations(static_cast<int>(catalogue.size()))) {
  for (const auto& effect : catalogue) {
    ranks_.emplace(effect->kind(), static_cast<int>(ranks_.size()));
  }
}

void EffectSearch::Say(const std::string& what,
                       const FittedSet& fitted) const {
  if (!VLOG_IS_ON(1)) return;
  std::string names;
  for (const int e : fitted.effects) names += " " + catalogue_[e]->name();
  char text[200];
  std::snprintf(text, sizeof(text),
                ": error %.3f, train %.3f, held out %.3f, %.2f s, %d parameters",
                fitted.error(), fitted.model.train_error(),
                fitted.model.holdout_error(), fitted.model.fit.segment_s,
                fitted.parameters);
  VLOG(1) << what << names << text
          << (fitted.refused.empty() ? "" : "; refused: " + fitted.refused)
          << (fitted.model.fit.converged ? "" : "; not converged");
}

int EffectSearch::Rank(const std::vector<int>& effects) const {
  int rank = 0;
  for (const int e : effects) rank += ranks_.at(catalogue_[e]->kind());
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
      FittedSet{std::move(effects), std::move(model), {}, 0, "", false});
  if (std::isfinite(fitted->error())) {
    fitted->log_errors = fitted->model.cv.LogErrors();
  }
  fitted->parameters = CountParameters(fitted->model);
  fitted->refused = WhyNoAnswer(problem_, fitted->model);
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
    int parameters;
    ArrayXd log_errors;
    Fitted fitted;
  };
  std::vector<Item> items;
  for (const auto& [effects, fitted] : store_) {
    if (!fitted->IsAnswer()) continue;
    items.push_back({fitted->parameters, fitted->log_errors, fitted});
  }
  std::stable_sort(items.begin(), items.end(), [](const auto& a, const auto& b) {
    return std::pair(a.parameters, a.fitted->error()) <
           std::pair(b.parameters, b.fitted->error());
  });
  if (items.empty()) return nullptr;
  const std::vector<Item> unbeaten = FewestUnbeaten(items, deviations_);
  const auto least = std::min_element(
      unbeaten.begin(), unbeaten.end(), [](const auto& a, const auto& b) {
        return a.fitted->error() < b.fitted->error();
      });
  // Of those that are as good, the most common laws.
  Fitted best = least->fitted;
  for (const Item& item : unbeaten) {
    const Difference by = DifferenceOf(item.log_errors, least->log_errors);
    if (by.mean <= by.std_error &&
        Rank(item.fitted->effects) < Rank(best->effects)) {
      best = item.fitted;
    }
  }
  return best;
}

bool EffectSearch::WasLookedFrom(const FittedSet& at) const {
  return std::any_of(looks_.begin(), looks_.end(),
                     [&](const Look& look) { return look.at.get() == &at; });
}

bool EffectSearch::LookFrom(const Fitted& at) {
  report_("looking for what is missing", at->model.train_error());
  Look look{at, nullptr, {}, {}};
  look.sets = std::make_unique<LinearSets>(problem_, at->model, catalogue_);
  ++look_count_;
  if (look.sets->Valid()) look.predicted = SearchSets(*look.sets);
  Say("look at " + std::to_string(look.predicted.size()) + " sets from",
      *at);
  looks_.push_back(std::move(look));
  return !looks_.back().predicted.empty();
}

std::optional<EffectSearch::Proposal> EffectSearch::NextProposal(
    const FittedSet& best) const {
  // A fit from elsewhere may end elsewhere: worth another where it should leave
  // so much less.
  constexpr double kMuchLess = 0.8;
  struct Item {
    int parameters;
    ArrayXd log_errors;
    const Look* look;
    const PredictedSet* predicted;
    double mean() const { return log_errors.mean(); }
  };
  // Of all looks the nearest one counts, the last of those.
  std::map<std::vector<int>, std::pair<size_t, Item>> nearest;
  for (const Look& look : looks_) {
    for (const PredictedSet& one : look.predicted) {
      const std::vector<int>& effects = one.score.effects;
      if (tried_.contains({effects, look.at.get()})) continue;
      ArrayXd logs = one.log_errors;
      const ArrayXd now =
          look.sets->LogErrors(
              (2.0 * OfFittedRuns(*look.at, logs.size())).exp().eval());
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
      const size_t distance = Distance(effects, look.at->effects);
      const auto at = nearest.find(effects);
      if (at != nearest.end() && at->second.first < distance) continue;
      nearest.insert_or_assign(
          effects, std::pair(distance, Item{one.score.parameters,
                                            std::move(logs), &look, &one}));
    }
  }
  std::vector<Item> items;
  for (auto& [effects, at] : nearest) {
    Item& item = at.second;
    const ArrayXd now = item.look->sets->LogErrors(
        (2.0 * OfFittedRuns(best, item.log_errors.size())).exp().eval());
    if (now.size() != item.log_errors.size()) continue;
    bool wanted = false;
    if (item.parameters > best.parameters) {
      wanted = Beats(item.log_errors, now, deviations_);
    } else {
      wanted = !Beats(now, item.log_errors, deviations_);
      // As many parameters must do better; fewer are only asked for where the
      // best itself was linearised: what goes far is not predicted.
      if (item.parameters == best.parameters) {
        const Difference by = DifferenceOf(now, item.log_errors);
        wanted = wanted && by.mean > std::max(by.std_error, kLeastGain);
      } else if (item.look->at.get() != &best) {
        wanted = wanted && !Beats(now, item.log_errors, 1.0);
      }
    }
    if (wanted) items.push_back(std::move(item));
  }
  if (items.empty()) return std::nullopt;
  std::stable_sort(items.begin(), items.end(), [](const auto& a, const auto& b) {
    return std::tuple(a.parameters, a.predicted->score.effects.size(),
                      a.mean()) < std::tuple(b.parameters,
                                             b.predicted->score.effects.size(),
                                             b.mean());
  });
  std::vector<Item> unbeaten = FewestUnbeaten(items, deviations_);
  const auto first = std::min_element(
      unbeaten.begin(), unbeaten.end(),
      [](const auto& a, const auto& b) { return a.mean() < b.mean(); });
  auto chosen = first;
  for (auto item = unbeaten.begin(); item != unbeaten.end(); ++item) {
    if (item->mean() < first->mean() + 1e-3 &&
        Rank(item->predicted->score.effects) <
            Rank(chosen->predicted->score.effects)) {
      chosen = item;
    }
  }
  return Proposal{chosen->look, chosen->predicted, chosen->log_errors};
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
  ++fits_;
  return Keep(effects,
              EvaluateFrom(problem_, from.model, EffectsOf(effects), without,
                           all, enough, TrialOptions(problem_.options, error)));
}

EffectSearch::Fitted EffectSearch::Fit(const Proposal& proposal) {
  constexpr double kOfPromise = 0.5;
  Look& look = const_cast<Look&>(*proposal.look);
  const LinearSets::Score& score = proposal.predicted->score;
  const FittedSet& from = *look.at;
  tried_.insert({score.effects, &from});
  const double promised = std::exp(0.5 * score.squares.log().mean());
  const double now =
      std::exp(OfFittedRuns(from, score.squares.size()).mean());
  const double left = std::min(1.0, std::pow(promised / now, 2));
  // The whole joint step, less of it, and none: its first order may overshoot.
  std::vector<std::map<std::string, double>> starts;
  for (const double part : {1.0, 0.3, 0.0}) {
    starts.push_back(look.sets->StartOf(score, part));
  }
  Fitted fitted =
      FitFrom(from, score.effects, look.sets->WithoutInfluence(score), starts,
              (1.0 - kOfPromise * (1.0 - left)) * from.model.fit.train.squares,
              std::max(1.0, promised));
  const double ratio = fitted->error() / promised;
  if (!(ratio < kRefuted)) {
    std::set<int> added = Minus(score.effects, from.effects);
    if (added.empty()) added = {score.effects.begin(), score.effects.end()};
    look.refuted.push_back({added, std::log(std::min(ratio, 1e3))});
  }
  char text[60];
  std::snprintf(text, sizeof(text), "fit (%.2f predicted)", promised);
  Say(text, *fitted);
  return fitted;
}

void EffectSearch::SearchAtHorizon() {
  looks_.clear();
  int fits = 0, failures = 0;
  Fitted best = Best();
  while (best != nullptr) {
    if (!WasLookedFrom(*best)) LookFrom(best);
    std::optional<Proposal> next;
    if (fits < kMostFits && failures < kMostFailures) {
      next = NextProposal(*best);
    }
    if (next) {
      Fit(*next);
      ++fits;
      const Fitted now = Best();
      failures = now == best ? failures + 1 : 0;
      best = now;
      continue;
    }
    if (best->is_final) return;
    // To the end: what is gained may change what is the best.
    best->is_final = true;
    if (best->model.fit.converged && best->effects.empty()) return;
    Fitted again = Keep(best->effects, EvaluateAgain(problem_, best->model));
    again->is_final = true;
    Say("to the end", *again);
    best = Best();
  }
}

void EffectSearch::LeaveOutEach() {
  for (Fitted best = Best(); best != nullptr && best->effects.size() > 1;) {
    for (const int e : best->effects) {
      std::vector<int> rest = best->effects;
      rest.erase(std::find(rest.begin(), rest.end(), e));
      if (store_.contains(rest)) continue;
      Say("without", *FitFrom(*best, rest, {}, {}, 0.0,
                              std::max(1.0, best->error())));
    }
    const Fitted now = Best();
    if (now == best || now->parameters >= best->parameters) return;
    best = now;
  }
}

std::vector<std::shared_ptr<const FittedSet>> EffectSearch::FindRivals(
    const FittedSet& best) {
  constexpr int kMostRivals = 3;
  constexpr double kAlike = 0.9;   // of what the best explains
  constexpr double kFarOff = 0.3;  // ln
  struct Item {
    double mean;
    const Look* look;
    const PredictedSet* predicted;
  };
  std::map<std::vector<int>, Item> items;
  for (const Look& look : looks_) {
    const auto own = std::find_if(
        look.predicted.begin(), look.predicted.end(),
        [&](const auto& one) { return one.score.effects == best.effects; });
    if (own == look.predicted.end()) continue;
    const ArrayXd now =
        (2.0 * OfFittedRuns(*look.at, own->log_errors.size())).exp();
    const auto explained = [&](const PredictedSet& one) {
      return (now - one.score.squares).sum();
    };
    for (const PredictedSet& one : look.predicted) {
      const std::vector<int>& effects = one.score.effects;
      if (store_.contains(effects) || effects.size() > best.effects.size() ||
          one.score.parameters > best.parameters) {
        continue;
      }
      const Difference by = DifferenceOf(one.log_errors, own->log_errors);
      const bool near =
          by.mean <= std::max(std::min(by.std_error, kFarOff),
                              std::log1p(kMatters)) ||
          explained(one) > kAlike * explained(*own);
      if (!near) continue;
      const auto at = items.find(effects);
      if (at == items.end() || by.mean < at->second.mean) {
        items.insert_or_assign(effects, Item{by.mean, &look, &one});
      }
    }
  }
  std::vector<Item> order;
  for (const auto& [effects, item] : items) order.push_back(item);
  std::stable_sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
    return a.mean < b.mean;
  });
  if (order.size() > kMostRivals) order.resize(kMostRivals);
  for (const Item& item : order) {
    Fit({item.look, item.predicted, item.predicted->log_errors});
  }
  std::vector<std::shared_ptr<const FittedSet>> rivals;
  for (const auto& [effects, fitted] : store_) {
    if (!fitted->IsAnswer() || effects == best.effects ||
        fitted->parameters > best.parameters) {
      continue;
    }
    const Difference by = DifferenceOf(fitted->log_errors, best.log_errors);
    if (by.mean <= std::max(by.std_error, 1e-3)) rivals.push_back(fitted);
  }
  return rivals;
}

EffectSearch::Answer EffectSearch::Run(const EvaluatedModel& given,
                                       const std::vector<int>& start) {
  Answer answer;
  answer.base = Keep({}, given);
  Say("base", *answer.base);
  if (!start.empty()) {
    const Fitted base = store_.at({});
    Fitted from = FitFrom(*base, start, {}, {}, 0.0, 1.0);
    Say("start", *from);
    if (from->IsAnswer()) store_.erase(std::vector<int>{});
  }
  while (true) {
    SearchAtHorizon();
    const Fitted best = Best();
    if (best == nullptr) break;
    auto longer = Lengthen(problem_, best->model, report_);
    if (!longer) break;
    const std::vector<int> effects = best->effects;
    store_.clear();
    tried_.clear();
    looks_.clear();
    Say("longer", *Keep(effects, std::move(*longer)));
  }
  LeaveOutEach();
  Fitted best = Best();
  if (best != nullptr && !best->effects.empty()) {
    FindRivals(*best);
    best = Best();
    if (!best->effects.empty()) answer.rivals = FindRivals(*best);
  }
  answer.found = best != nullptr ? best : answer.base;
  answer.at_noise = IsAtNoiseFloor(answer.found->model);
  answer.explains =
      answer.at_noise ||
      (!answer.found->effects.empty() &&
       ExplainsMost(problem_, given, answer.found->model, 1.0));
  answer.fits = fits_;
  answer.looks = look_count_;
  return answer;
}

}  // namespace sysid
