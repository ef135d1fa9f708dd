#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sysid/diagnosis/comparison.h"
#include "sysid/diagnosis/evaluated_model.h"

namespace sysid {

// A set of effects of the catalogue beside the model as given, fitted at a
// horizon.
struct FittedSet {
  std::vector<int> effects;  // in the catalogue, ascending
  EvaluatedModel model;
  ModelScore score;
  std::string refused;  // why it is no answer; else empty
  // One of its effects whose law excludes the values.
  std::optional<int> implausible;
  // The one of its effects that the data determines least, where that is not
  // enough.
  std::optional<int> undetermined;
  bool is_final = false;  // fitted until nothing is to be gained

  double error() const { return model.cv.error(); }
  bool IsAnswer() const {
    return refused.empty() && score.log_errors.size() > 0;
  }
};

// What (J.2) compares of a fitted model.
ModelScore ScoreOf(const EvaluatedModel& model);

// Its log errors without the stretches that have no data, as LinearSets has
// them.
Eigen::ArrayXd LogErrorsWithData(const FittedSet& fitted);

// With GLOG_vmodule=fitted_sets=1.
void Log(const std::string& what, const Candidates& catalogue,
         const FittedSet& fitted);

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
    bool beaten = false;
    for (const Item& other : items) {
      beaten |= &other != &item && Beats(other.score, item.score);
    }
    if (!beaten) unbeaten.push_back(item);
  }
  return unbeaten.empty() ? items : unbeaten;
}

// How common the laws of a set are: the sum of their kinds' places in the
// catalogue of all; then their names, so that of the same laws always the same
// one is chosen. Less is more common.
class Commonness {
 public:
  explicit Commonness(const Candidates& catalogue);
  using Rank = std::pair<int, std::vector<std::string>>;
  Rank Of(const std::vector<int>& effects) const;

 private:
  const Candidates& catalogue_;
  std::map<std::string, int> places_;
};

// All fits of a search: section 5 of docs/judgement.md. Those of one horizon,
// and of shorter ones which set beat which.
class FittedSets {
 public:
  using Fitted = std::shared_ptr<FittedSet>;

  // Both must outlive it.
  FittedSets(const DiagnosisProblem& problem, const Candidates& catalogue);

  // Judges whether it is an answer, and keeps it. A set that was fitted before
  // stays as it did best.
  Fitted Keep(std::vector<int> effects, EvaluatedModel model);
  Fitted Find(const std::vector<int>& effects) const;  // or null
  std::vector<std::shared_ptr<const FittedSet>> All() const;
  void Remove(const std::vector<int>& effects) { sets_.erase(effects); }

  // Of the answers the set with the fewest parameters that none beats; of such
  // that are as good, the one of the more common laws. Null: there is none.
  Fitted Best() const;
  // Others with no more parameters that are not worse by more than a standard
  // error.
  std::vector<std::shared_ptr<const FittedSet>> RivalsOf(
      const FittedSet& best) const;

  // Empties it for longer segments. Whatever the best set beat stays beaten by
  // it: longer segments are fewer, and say less.
  void GoOnWith(const FittedSet& best);
  // Makes it what it was.
  void Restore(const FittedSets& before);
  // Whether a set was beaten over shorter segments.
  bool WasBeaten(const std::vector<int>& effects) const {
    return beaten_by_.contains(effects);
  }
  void ForgetThatItWasBeaten(const std::vector<int>& effects) {
    beaten_by_.erase(effects);
  }

  // An effect that a random force may have made up: no set with it is an
  // answer. What `best`, which has it, beat is beaten by what is left of it.
  void RefuseAsChance(int effect, const FittedSet& best);
  bool IsChance(int effect) const { return chance_.contains(effect); }

 private:
  void RefuseChanceIn(FittedSet* fitted) const;
  // Whether it was beaten over shorter segments by an answer which it does not
  // leave behind now.
  bool IsBeaten(const FittedSet& fitted) const;

  const DiagnosisProblem& problem_;
  const Candidates& catalogue_;
  const Commonness commonness_;
  std::map<std::vector<int>, Fitted> sets_;
  std::map<std::vector<int>, std::vector<int>> beaten_by_;
  std::set<int> chance_;
};

}  // namespace sysid
