#include "sysid/diagnosis/fitted_sets.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "glog/logging.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/diagnosis/no_answer.h"
#include "sysid/unexplained_force/discrepancy.h"

namespace sysid {
namespace {

using Eigen::ArrayXd;

int CountParameters(const EvaluatedModel& model) {
  int count = 0;
  for (const auto& effect : model.added) {
    for (const std::string& name : effect->ParameterNames()) {
      if (!model.without_influence.contains(name)) ++count;
    }
  }
  return count;
}

// Parameters that the data does not tell apart though none of them is of the
// model as given: what the effects have themselves made superfluous.
std::set<std::string> NotTold(const DiagnosisProblem& problem, const Fit& fit) {
  std::set<std::string> not_told;
  for (const std::vector<std::string>& group : fit.not_identifiable) {
    const bool given =
        std::any_of(problem.free.begin(), problem.free.end(),
                    [&](const FreeParameter& free) {
                      return std::find(group.begin(), group.end(),
                                       free.parameter.name) != group.end();
                    });
    if (!given) not_told.insert(group.begin(), group.end());
  }
  return not_told;
}

// Whether all parameters of an effect that were fitted are among them.
bool IsNotTold(const Effect& effect, const Fit& fit,
               const std::set<std::string>& not_told) {
  bool any = false;
  for (const std::string& name : effect.ParameterNames()) {
    for (const ParameterEstimate& p : fit.parameters) {
      if (p.name != name) continue;
      if (!not_told.contains(name)) return false;
      any = true;
    }
  }
  return any;
}

}  // namespace

ModelScore ScoreOf(const EvaluatedModel& model) {
  ModelScore score;
  if (std::isfinite(model.cv.error())) score.log_errors = model.cv.LogErrors();
  score.parameters = CountParameters(model);
  score.at_noise = IsAtNoiseFloor(model);
  return score;
}

ArrayXd LogErrorsWithData(const FittedSet& fitted) {
  ArrayXd some(fitted.score.log_errors.size());
  Eigen::Index n = 0;
  for (const double log : fitted.score.log_errors) {
    if (!std::isnan(log)) some[n++] = log;
  }
  return some.head(n);
}

void Log(const std::string& what, const Candidates& catalogue,
         const FittedSet& fitted) {
  if (!VLOG_IS_ON(1)) return;
  std::string names;
  for (const int e : fitted.effects) names += " " + catalogue[e]->name();
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

Commonness::Commonness(const Candidates& catalogue) : catalogue_(catalogue) {
  for (const std::string& kind : Catalogue().kinds()) {
    places_.emplace(kind, static_cast<int>(places_.size()));
  }
}

Commonness::Rank Commonness::Of(const std::vector<int>& effects) const {
  Rank rank;
  for (const int e : effects) {
    const auto at = places_.find(catalogue_[e]->kind());
    rank.first +=
        static_cast<int>(at != places_.end() ? at->second : places_.size());
    rank.second.push_back(catalogue_[e]->name());
  }
  std::sort(rank.second.begin(), rank.second.end());
  return rank;
}

FittedSets::FittedSets(const DiagnosisProblem& problem,
                       const Candidates& catalogue)
    : problem_(problem), catalogue_(catalogue), commonness_(catalogue) {}

FittedSets::Fitted FittedSets::Keep(std::vector<int> effects,
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
    const std::set<std::string> not_told = NotTold(problem_, fitted->model.fit);
    for (const int e : fitted->effects) {
      const double p =
          IsNotTold(*catalogue_[e], fitted->model.fit, not_told)
              ? 1.0
              : PValueOf(*catalogue_[e], problem_.model, fitted->model.fit);
      if (!(p > most)) continue;
      most = p;
      fitted->undetermined = e;
    }
    if (fitted->undetermined) {
      fitted->refused = "this data does not determine " +
                        catalogue_[*fitted->undetermined]->name();
    }
  }
  RefuseChanceIn(fitted.get());
  Fitted& at = sets_[fitted->effects];
  // The same set may have been fitted from elsewhere: as it did best.
  if (at == nullptr || !at->IsAnswer() ||
      (fitted->IsAnswer() && fitted->error() < at->error())) {
    at = fitted;
  }
  return fitted;
}

FittedSets::Fitted FittedSets::Find(const std::vector<int>& effects) const {
  const auto at = sets_.find(effects);
  return at == sets_.end() ? nullptr : at->second;
}

std::vector<std::shared_ptr<const FittedSet>> FittedSets::All() const {
  std::vector<std::shared_ptr<const FittedSet>> all;
  for (const auto& [effects, fitted] : sets_) all.push_back(fitted);
  return all;
}

FittedSets::Fitted FittedSets::Best() const {
  struct Item {
    ModelScore score;
    Fitted fitted;
  };
  std::vector<Item> items;
  for (const auto& [effects, fitted] : sets_) {
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
    if (IsAsGood(item.score, least->score) &&
        commonness_.Of(item.fitted->effects) < commonness_.Of(best->effects)) {
      best = item.fitted;
    }
  }
  return best;
}

std::vector<std::shared_ptr<const FittedSet>> FittedSets::RivalsOf(
    const FittedSet& best) const {
  std::vector<std::shared_ptr<const FittedSet>> rivals;
  for (const auto& [effects, fitted] : sets_) {
    if (!fitted->IsAnswer() || effects == best.effects ||
        fitted->score.parameters > best.score.parameters) {
      continue;
    }
    if (IsAsGood(fitted->score, best.score)) rivals.push_back(fitted);
  }
  return rivals;
}

bool FittedSets::IsBeaten(const FittedSet& fitted) const {
  const auto by = beaten_by_.find(fitted.effects);
  if (by == beaten_by_.end()) return false;
  const auto at = sets_.find(by->second);
  return at != sets_.end() && at->second->IsAnswer() &&
         !Matters(fitted.score, at->second->score);
}

void FittedSets::GoOnWith(const FittedSet& best) {
  for (const auto& [effects, fitted] : sets_) {
    if (effects == best.effects) continue;
    // Those with fewer parameters were beaten by some, or they were the best.
    if (!fitted->IsAnswer() ||
        fitted->score.parameters < best.score.parameters ||
        Beats(best.score, fitted->score)) {
      beaten_by_[effects] = best.effects;
    }
  }
  beaten_by_.erase(best.effects);
  sets_.clear();
}

void FittedSets::Restore(const FittedSets& before) {
  sets_ = before.sets_;
  beaten_by_ = before.beaten_by_;
}

void FittedSets::RefuseAsChance(int effect, const FittedSet& best) {
  chance_.insert(effect);
  for (const auto& [effects, fitted] : sets_) RefuseChanceIn(fitted.get());
  std::vector<int> rest = best.effects;
  std::erase(rest, effect);
  for (const auto& [effects, fitted] : sets_) {
    if (effects != rest && Beats(best.score, fitted->score)) {
      beaten_by_[effects] = rest;
    }
  }
}

void FittedSets::RefuseChanceIn(FittedSet* fitted) const {
  for (const int e : fitted->effects) {
    if (!chance_.contains(e)) continue;
    fitted->refused =
        "a random force as large as the remaining error could make up " +
        catalogue_[e]->name();
  }
}

}  // namespace sysid
