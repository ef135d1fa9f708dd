#include "sysid/diagnosis/candidate_list.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace sysid {
namespace {

// A candidate that would explain this part of what another does may stand for
// it.
constexpr double kAlike = 0.9;
// This much, both ways, and they are the same to any eye: chance alone would
// choose between their refits.
constexpr double kSame = 0.999;

bool StandsOut(const CandidateEffect& candidate) {
  return candidate.screened.criterion < -kClearly ||
         (candidate.confirmed && candidate.confirmed->accepted);
}

// The refit of one effect alone; nullptr where there was none.
const CandidateRefit* RefitOf(const std::vector<CandidateRefit>& refits,
                              int effect) {
  const auto at =
      std::find_if(refits.begin(), refits.end(), [&](const CandidateRefit& t) {
        return t.effects == std::vector<int>{effect};
      });
  return at == refits.end() ? nullptr : &*at;
}

Confirmation ConfirmationOf(const Screening& screening,
                            const CandidateRefit& refit, size_t which) {
  const ScreenedEffect& effect = screening.effects[refit.effects[which]];
  Confirmation confirmed;
  confirmed.train = refit.after->train_error();
  confirmed.holdout = refit.after->holdout_error();
  confirmed.cv = refit.after->cv;
  confirmed.segment_s = refit.after->fit.segment_s;
  confirmed.parameters = EstimatesOf(*refit.after, {effect.effect.get()});
  confirmed.accepted = refit.accepted();
  confirmed.refused = refit.refused;
  if (refit.effects.size() == 2) {
    confirmed.together_with = {
        screening.effects[refit.effects[1 - which]].name()};
  }
  return confirmed;
}

// The chosen, then the accepted, then the refused, by their errors.
std::vector<int> RankRefits(const std::vector<CandidateRefit>& refits,
                            int best) {
  std::vector<int> order(refits.size());
  std::iota(order.begin(), order.end(), 0);
  const auto rank = [&](int i) {
    return i == best ? 0 : refits[i].accepted() ? 1 : 2;
  };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    if (rank(a) != rank(b)) return rank(a) < rank(b);
    return refits[a].after->cv.error() < refits[b].after->cv.error();
  });
  return order;
}

std::string ToldApartBy(const Screening& screening, int a, int b) {
  const ScreenedEffect& one = screening.effects[a];
  const ScreenedEffect& other = screening.effects[b];
  constexpr double kSame = 1 - 1e-6;
  if (screening.confusability(a, b) > kSame &&
      screening.confusability(b, a) > kSame) {
    return "with this mechanism and mounting, both have the same effect in "
           "such motions; " +
           one.name() + " is identified by " + one.effect->ShowsIn();
  }
  return ToldApartBy(*one.effect, *other.effect);
}

}  // namespace

std::string ToldApartBy(const Effect& one, const Effect& other) {
  if (one.ShowsIn() == other.ShowsIn()) {
    return "they differ only in how they grow over " + one.ShowsIn() +
           ": the wider its range, the better";
  }
  return one.name() + " is identified by " + one.ShowsIn() + "; " +
         other.name() + " by " + other.ShowsIn();
}

std::vector<ParameterEstimate> EstimatesOf(
    const EvaluatedModel& evaluated,
    const std::vector<const Effect*>& effects) {
  std::vector<ParameterEstimate> estimates;
  for (const Effect* effect : effects) {
    for (const std::string& name : effect->ParameterNames()) {
      for (const ParameterEstimate& p : evaluated.fit.parameters) {
        if (p.name == name) estimates.push_back(p);
      }
    }
  }
  return estimates;
}

bool StandFor(const Screening& screening, int a, int b,
              const EvaluatedModel& with_a, const EvaluatedModel& with_b) {
  return AreAsGood(with_a, with_b) &&
         (screening.confusability(a, b) > kAlike || IsAtNoiseFloor(with_a));
}

std::vector<std::string> AlikeTo(const Screening& screening,
                                 const std::string& effect) {
  constexpr size_t kMost = 3;  // as AddRivals: each is a refit
  std::vector<std::string> alike;
  const int own = screening.IndexOf(effect);
  if (own < 0) return alike;
  const ScreenedEffect& it = screening.effects[own];
  for (size_t i = 0; i < screening.effects.size(); ++i) {
    const ScreenedEffect& other = screening.effects[i];
    if (alike.size() < kMost && other.name() != effect && other.dof <= it.dof &&
        other.predicted_error < kNear * it.predicted_error &&
        screening.confusability(own, i) > kAlike) {
      alike.push_back(other.name());
    }
  }
  return alike;
}

std::vector<std::string> ThatExplainTheSame(
    const Screening& screening, const std::vector<CandidateRefit>& refits,
    int best) {
  std::vector<std::string> same;
  const CandidateRefit& chosen = refits[best];
  if (chosen.effects.size() != 1) return same;
  for (const CandidateRefit& refit : refits) {
    if (refit.effects.size() != 1 || refit.effects == chosen.effects ||
        !refit.accepted() || refit.expected[0].dof > chosen.expected[0].dof) {
      continue;
    }
    if (screening.confusability(chosen.effects[0], refit.effects[0]) > kAlike) {
      same.push_back(refit.expected[0].name());
    }
  }
  return same;
}

std::vector<CandidateEffect> ListCandidates(
    const Screening& screening, const std::vector<CandidateRefit>& refits,
    int best) {
  std::vector<CandidateEffect> candidates;
  std::vector<int> source;  // of the candidates, in the screening
  std::vector<bool> listed(screening.effects.size(), false);
  const auto list = [&](int effect, std::optional<Confirmation> confirmed) {
    if (listed[effect]) return;
    listed[effect] = true;
    source.push_back(effect);
    candidates.push_back(
        {screening.effects[effect], std::move(confirmed), {}, "", {}});
  };
  for (const int t : RankRefits(refits, best)) {
    for (size_t k = 0; k < refits[t].effects.size(); ++k) {
      list(refits[t].effects[k], ConfirmationOf(screening, refits[t], k));
    }
  }
  for (size_t i = 0; i < screening.effects.size(); ++i) {
    list(static_cast<int>(i), std::nullopt);
  }
  // Which of them the data cannot tell apart: by the refits where both were
  // refitted, else to first order.
  const auto same = [&](int a, int b) {
    const CandidateRefit* one = RefitOf(refits, a);
    const CandidateRefit* other = RefitOf(refits, b);
    if ((one && !one->accepted()) != (other && !other->accepted())) {
      return false;
    }
    const double like = screening.confusability(a, b);
    if (like > kSame && screening.confusability(b, a) > kSame) return true;
    if (one && one->accepted() && other) {
      return StandFor(screening, a, b, *one->after, *other->after);
    }
    return like > kSame ||
           (like > kAlike &&
            std::abs(screening.effects[a].criterion -
                     screening.effects[b].criterion) < kClearly);
  };
  for (size_t a = 0; a < source.size(); ++a) {
    CandidateEffect& candidate = candidates[a];
    if (!StandsOut(candidate)) continue;
    for (size_t b = 0; b < source.size(); ++b) {
      const CandidateEffect& other = candidates[b];
      if (a == b || !StandsOut(other) || !same(source[a], source[b])) continue;
      candidate.indistinguishable_from.push_back(other.screened.name());
      if (candidate.told_apart_by.empty()) {
        candidate.told_apart_by = ToldApartBy(screening, source[a], source[b]);
      }
    }
  }
  return candidates;
}

}  // namespace sysid
