#include "sysid/diagnosis/looks.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <tuple>
#include <utility>

#include "glog/logging.h"
#include "sysid/diagnosis/judgement_constants.h"

namespace sysid {
namespace {

using Eigen::ArrayXd;

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

Looks::Looks(const DiagnosisProblem& problem, const Candidates& catalogue,
             const FittedSets& fitted)
    : problem_(problem),
      catalogue_(catalogue),
      fitted_(fitted),
      commonness_(catalogue) {}

void Looks::From(const std::shared_ptr<FittedSet>& at) {
  Look look{at, nullptr, {}, {}};
  if (const auto before = refuted_.find(at->effects);
      before != refuted_.end()) {
    look.refuted = before->second;
  }
  look.sets = std::make_unique<LinearSets>(problem_, at->model, catalogue_);
  if (look.sets->Valid()) look.predicted = SearchSets(*look.sets);
  Log("look at " + std::to_string(look.predicted.size()) + " sets from",
      catalogue_, *at);
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

bool Looks::WasMadeFrom(const FittedSet& at) const {
  return std::any_of(looks_.begin(), looks_.end(), [&](const Look& look) {
    return look.at->effects == at.effects && !Matters(at.score, look.at->score);
  });
}

bool Looks::Refuted::Has(const std::vector<int>& effects,
                         const std::vector<int>& of_look) const {
  const auto includes = [](const auto& all, const std::set<int>& some) {
    return std::includes(all.begin(), all.end(), some.begin(), some.end());
  };
  return includes(effects, added) &&
         (!over_others || includes(Minus(of_look, effects), removed));
}

void Looks::GoOn() {
  for (Look& look : looks_) {
    for (Refuted& one : look.refuted) one.over_others = true;
    refuted_[look.at->effects] = std::move(look.refuted);
  }
  Clear();
}

void Looks::Clear() {
  looks_.clear();
  tried_.clear();
}

std::vector<Looks::Prediction> Looks::Nearest() const {
  std::map<std::vector<int>, std::pair<size_t, Prediction>> nearest;
  for (size_t l = 0; l < looks_.size(); ++l) {
    const Look& look = looks_[l];
    const ArrayXd now = NowAt(look, *look.at).log_errors;
    for (const PredictedSet& one : look.predicted) {
      const std::vector<int>& effects = one.score.effects;
      if (tried_.contains({effects, look.at.get()}) ||
          std::any_of(effects.begin(), effects.end(),
                      [&](int e) { return fitted_.IsChance(e); })) {
        continue;
      }
      ArrayXd logs = one.log_errors;
      for (const Refuted& refuted : look.refuted) {
        if (refuted.Has(effects, look.at->effects)) {
          logs = logs.max((one.log_errors + refuted.ratio).min(now));
        }
      }
      const auto known = fitted_.Find(effects);
      if (known != nullptr &&
          (effects == look.at->effects ||
           !(std::exp(logs.mean()) < kMuchLess * known->error()))) {
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

ModelScore Looks::NowAt(const Look& look, const FittedSet& fitted) {
  return {look.sets->LogErrors((2.0 * LogErrorsWithData(fitted)).exp().eval()),
          fitted.score.parameters};
}

bool Looks::IsWanted(const Prediction& one, const ModelScore& now,
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

ProposedSet Looks::Propose(const Look& look, const LinearSets::Score& score) {
  ProposedSet proposed{score.effects,
                       score.parameters,
                       look.sets->WithoutInfluence(score),
                       {},
                       look.at,
                       std::exp(0.5 * score.squares.log().mean())};
  for (const double part : {1.0, 0.3, 0.0}) {
    proposed.starts.push_back(look.sets->StartOf(score, part));
  }
  return proposed;
}

std::optional<ProposedSet> Looks::Next(const FittedSet& best) const {
  const auto is_less = [](const Prediction& a, const Prediction& b) {
    return a.mean() < b.mean();
  };
  const auto propose = [&](const Prediction& one) {
    return Propose(looks_[one.look], one.set->score);
  };
  std::vector<Prediction> wanted, others;
  for (Prediction& one : Nearest()) {
    const std::vector<int>& effects = one.set->score.effects;
    const ModelScore now = NowAt(looks_[one.look], best);
    if (now.log_errors.size() != one.score.log_errors.size()) continue;
    if (fitted_.WasBeaten(effects) && !Matters(one.score, now)) continue;
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
    return propose(*std::min_element(others.begin(), others.end(), is_less));
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
        commonness_.Of(one->set->score.effects) <
            commonness_.Of(chosen->set->score.effects)) {
      chosen = one;
    }
  }
  return propose(*chosen);
}

void Looks::Learn(const ProposedSet& proposed, const FittedSet& fitted) {
  const FittedSet& from = *proposed.from;
  tried_.insert({proposed.effects, &from});
  const auto look =
      std::find_if(looks_.begin(), looks_.end(),
                   [&](const Look& one) { return one.at.get() == &from; });
  if (look == looks_.end()) return;
  constexpr double kAsBadAsCanBe = 1e3;
  const double ratio = fitted.error() / proposed.error;
  const std::set<int> removed = Minus(from.effects, proposed.effects);
  if (fitted.implausible) {
    look->refuted.push_back(
        {{*fitted.implausible}, std::log(kAsBadAsCanBe), removed});
  } else if (!(ratio < kRefuted)) {
    std::set<int> added = Minus(proposed.effects, from.effects);
    if (added.empty()) {
      added = {proposed.effects.begin(), proposed.effects.end()};
    }
    look->refuted.push_back(
        {added, std::log(std::min(ratio, kAsBadAsCanBe)), removed});
  }
}

void Looks::NoteAlike(const FittedSet& best) {
  Alike& noted = alike_[best.effects];
  for (const Look& look : looks_) {
    const auto own = std::find_if(
        look.predicted.begin(), look.predicted.end(),
        [&](const auto& one) { return one.score.effects == best.effects; });
    if (own == look.predicted.end()) continue;
    const ArrayXd now = (2.0 * LogErrorsWithData(*look.at)).exp();
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
      const bool near = by.mean <= std::log1p(kMatters) ||
                        explained(one) > kRivalExplains * explained(*own);
      const auto at = noted.find(one.score.effects);
      if (!near || (at != noted.end() && at->second.first <= by.mean)) continue;
      noted.insert_or_assign(one.score.effects,
                             std::pair(by.mean, Propose(look, one.score)));
    }
  }
}

std::vector<ProposedSet> Looks::AlikeTo(const FittedSet& best) const {
  const auto noted = alike_.find(best.effects);
  if (noted == alike_.end()) return {};
  std::vector<std::tuple<int, double, const ProposedSet*>> order;
  for (const auto& [effects, alike] : noted->second) {
    order.emplace_back(alike.second.parameters, alike.first, &alike.second);
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) {
                     return std::pair(std::get<0>(a), std::get<1>(a)) <
                            std::pair(std::get<0>(b), std::get<1>(b));
                   });
  std::vector<ProposedSet> sets;
  for (const auto& [parameters, mean, set] : order) sets.push_back(*set);
  return sets;
}

const Looks::Look* Looks::LastFrom(const std::vector<int>& effects) const {
  const auto look =
      std::find_if(looks_.rbegin(), looks_.rend(),
                   [&](const Look& one) { return one.at->effects == effects; });
  return look == looks_.rend() ? nullptr : &*look;
}

bool Looks::IsSameForce(const FittedSet& best,
                        const std::vector<int>& effects) const {
  const Look* look = LastFrom(best.effects);
  const std::set<int> gone = Minus(best.effects, effects);
  const std::set<int> come = Minus(effects, best.effects);
  if (look == nullptr || gone.size() != 1 || come.size() != 1) return false;
  const std::vector<LinearSets::Term>& terms = look->sets->terms();
  LinearSets::Set rest = look->sets->members();
  std::erase_if(rest, [&](int t) { return terms[t].effect == *gone.begin(); });
  for (size_t t = 0; t < terms.size(); ++t) {
    if (terms[t].effect != *come.begin()) continue;
    LinearSets::Set set = rest;
    set.push_back(static_cast<int>(t));
    if (look->sets->DoTheSame(set, look->sets->members())) return true;
  }
  return false;
}

std::vector<ProposedSet> Looks::SameForceAs(const FittedSet& best) const {
  std::vector<ProposedSet> same;
  const Look* look = LastFrom(best.effects);
  if (look == nullptr) return same;
  for (const PredictedSet& one : look->predicted) {
    if (one.score.effects != best.effects &&
        one.score.parameters <= best.score.parameters &&
        look->sets->DoTheSame(one.score.set, look->sets->members())) {
      same.push_back(Propose(*look, one.score));
    }
  }
  std::stable_sort(same.begin(), same.end(), [&](const auto& a, const auto& b) {
    return commonness_.Of(a.effects) < commonness_.Of(b.effects);
  });
  return same;
}

}  // namespace sysid
