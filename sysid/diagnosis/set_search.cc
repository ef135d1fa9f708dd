#include "sysid/diagnosis/set_search.h"

#include <algorithm>
#include <map>
#include <utility>

#include "sysid/diagnosis/judgement_constants.h"

namespace sysid {
namespace {

using Set = LinearSets::Set;

Set Without(const Set& set, int term) {
  Set rest = set;
  rest.erase(std::remove(rest.begin(), rest.end(), term), rest.end());
  return rest;
}

// The sets that were looked at, each once.
class Looker {
 public:
  explicit Looker(const LinearSets& sets) : sets_(sets) {}

  // Of these the ones that can be told apart and are within their bounds, the
  // best first.
  std::vector<const PredictedSet*> Look(std::vector<Set> sets) {
    std::vector<const PredictedSet*> found;
    for (Set& set : sets) {
      const auto [at, is_new] = seen_.try_emplace(std::move(set));
      if (is_new) at->second = Predict(at->first);
      if (at->second) found.push_back(&*at->second);
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    std::stable_sort(found.begin(), found.end(),
                     [](const auto* a, const auto* b) {
                       return std::pair(a->mean, a->score.set) <
                              std::pair(b->mean, b->score.set);
                     });
    return found;
  }

  // A set with each further term in the place of what shares parameters with
  // it: wholes and parts of its laws among them.
  std::vector<Set> WithOneMore(const Set& set) const {
    std::vector<Set> more;
    const int count = static_cast<int>(sets_.terms().size());
    for (int t = 0; t < count; ++t) {
      const auto same_effect = [&](int s) {
        return sets_.terms()[s].effect == sets_.terms()[t].effect;
      };
      if (std::any_of(set.begin(), set.end(), same_effect)) continue;
      Set with = set;
      std::erase_if(with, [&](int s) { return sets_.Exclude(s, t); });
      with.insert(std::upper_bound(with.begin(), with.end(), t), t);
      more.push_back(std::move(with));
    }
    return more;
  }

  // The best of each number of effects.
  std::vector<Set> BestOfEachSize() const {
    std::map<size_t, const PredictedSet*> best;
    for (const auto& [set, predicted] : seen_) {
      if (!predicted) continue;
      const PredictedSet*& at = best[set.size()];
      if (at == nullptr || predicted->mean < at->mean) at = &*predicted;
    }
    std::vector<Set> sets;
    for (const auto& [size, one] : best) sets.push_back(one->score.set);
    return sets;
  }

  std::vector<PredictedSet> BestOfEachEffects() && {
    std::map<std::vector<int>, PredictedSet> best;
    for (auto& [set, predicted] : seen_) {
      if (!predicted) continue;
      const auto [at, is_new] =
          best.try_emplace(predicted->score.effects, *predicted);
      if (!is_new && predicted->mean < at->second.mean) at->second = *predicted;
    }
    std::vector<PredictedSet> all;
    for (auto& [effects, one] : best) all.push_back(std::move(one));
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
      return a.mean < b.mean;
    });
    return all;
  }

 private:
  std::optional<PredictedSet> Predict(const Set& set) const {
    auto score = sets_.ScoreOf(set);
    if (!score) return std::nullopt;
    PredictedSet predicted{std::move(*score), {}, 0.0};
    predicted.log_errors = sets_.LogErrors(predicted.score);
    predicted.mean = predicted.log_errors.mean();
    return predicted;
  }

  const LinearSets& sets_;
  std::map<Set, std::optional<PredictedSet>> seen_;
};

}  // namespace

std::vector<PredictedSet> SearchSets(const LinearSets& sets) {
  Looker looker(sets);
  const auto beam_of = [](const std::vector<const PredictedSet*>& found) {
    std::vector<Set> beam;
    for (const PredictedSet* one : found) {
      if (beam.size() == kBeam) break;
      beam.push_back(one->score.set);
    }
    return beam;
  };
  const auto with_one_more = [&](const std::vector<Set>& beam) {
    std::vector<Set> more;
    for (const Set& set : beam) {
      for (Set& with : looker.WithOneMore(set)) more.push_back(std::move(with));
    }
    return more;
  };
  // The model, without each of its members, and with none.
  std::vector<Set> begin = {sets.members(), {}};
  for (const int member : sets.members()) {
    begin.push_back(Without(sets.members(), member));
  }
  std::vector<Set> beam = begin;
  looker.Look(begin);
  for (int depth = 0; depth < kDepth && !beam.empty(); ++depth) {
    beam = beam_of(looker.Look(with_one_more(beam)));
  }
  // Of the best of each size without one, and with another one instead.
  std::vector<Set> fewer;
  for (const Set& set : looker.BestOfEachSize()) {
    for (const int term : set) fewer.push_back(Without(set, term));
  }
  looker.Look(with_one_more(beam_of(looker.Look(std::move(fewer)))));
  return std::move(looker).BestOfEachEffects();
}

}  // namespace sysid
