#include "sysid/diagnosis/candidate_refits.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "sysid/diagnosis/discrepancy.h"
#include "sysid/diagnosis/longer_segments.h"
#include "sysid/diagnosis/shared_refits.h"
#include "sysid/diagnosis/statistics.h"

namespace sysid {
namespace {

constexpr int kMostConfirmed = 6;  // candidates that are refitted in a round
constexpr int kMostPairs = 5;
constexpr double kSignificant = 0.05;  // of a p-value

// The names of all parameters of effects.
std::set<std::string> NamesOf(const std::vector<const Effect*>& effects) {
  std::set<std::string> names;
  for (const Effect* effect : effects) {
    for (const std::string& name : effect->ParameterNames()) names.insert(name);
  }
  return names;
}

// Whether all parameters of some effects are also others', which have more.
bool ArePartOf(const std::vector<const Effect*>& effects,
               const std::vector<const Effect*>& others) {
  const std::set<std::string> part = NamesOf(effects), all = NamesOf(others);
  return part.size() < all.size() &&
         std::includes(all.begin(), all.end(), part.begin(), part.end());
}

std::vector<const Effect*> EffectsOf(const Screening&,
                                     const ScreenedEffect& one) {
  return {one.effect.get()};
}

std::vector<const Effect*> EffectsOf(const Screening& screening,
                                     const Screening::Pair& pair) {
  return {screening.effects[pair.first].effect.get(),
          screening.effects[pair.second].effect.get()};
}

// Whether a part of an effect, or of a pair, is as good: that one first, and
// what the whole adds to it later.
template <typename Proposal>
bool IsExtravagant(const Screening& screening, const std::vector<Proposal>& all,
                   const Proposal& whole) {
  return std::any_of(all.begin(), all.end(), [&](const Proposal& part) {
    return ArePartOf(EffectsOf(screening, part), EffectsOf(screening, whole)) &&
           part.criterion < whole.criterion + kClearly;
  });
}

// Whether a refit is worth its time: the screening is clear, or it promises so
// much that the held-out runs should judge (where much else is missing, few
// samples are independent, and nothing is clear).
bool Promises(const Screening& screening, double predicted, double criterion) {
  constexpr double kMuch = 0.9;
  return (criterion < -kClearly &&
          predicted * (1.0 + kMatters) < screening.error) ||
         predicted < kMuch * screening.error;
}

}  // namespace

EstimationOptions TrialOptions(const EstimationOptions& options, double error) {
  constexpr int kIterations = 25;
  EstimationOptions trial = Coarse(options, error);
  trial.progress = nullptr;
  trial.max_iterations = kIterations;
  trial.least_gain = 2.0 * kMaterial;  // the cost is half the error's square
  return trial;
}

std::string WhyRefused(const DiagnosisProblem& problem,
                       const EvaluatedModel& before,
                       const CandidateRefit& refit, int tried) {
  const EvaluatedModel& after = *refit.after;
  if (!std::isfinite(after.cv.error())) {
    return "the motion does not stay finite with it";
  }
  const std::string implausible = WhyImplausible(after);
  if (!implausible.empty()) return implausible;
  // Such as an inertia so large that its joint rests, whatever its size.
  for (const ScreenedEffect& effect : refit.expected) {
    if (PValueOf(*effect.effect, problem.model, after.fit) > kSignificant) {
      return "this data does not determine " + effect.name();
    }
  }
  if (!IsWorse(before.cv, after.cv, tried)) {
    return "it does not improve the prediction of held-out data";
  }
  // Runs of their own say more than stretches of those that were fitted; what
  // was held out of these is one stretch more.
  return !problem.judged_by_others ||
                 after.holdout_error() < before.holdout_error()
             ? ""
             : "it does not lower the error of the held-out runs";
}

std::string WhyImplausible(const EvaluatedModel& evaluated) {
  for (const auto& effect : evaluated.added) {
    std::vector<std::string> names;
    for (const EffectParameter& own : effect->parameters()) {
      names.push_back(own.name);
    }
    std::vector<double> values;
    for (const Parameter& own :
         FindParameters(evaluated.fit.model, names, effect->name())) {
      values.push_back(own.nominal);
    }
    const std::string why = effect->Implausible(values);
    if (!why.empty()) return effect->name() + ": " + why;
  }
  return "";
}

bool IsPartOf(const Effect& part, const Effect& whole) {
  return ArePartOf({&part}, {&whole});
}

bool AreAsGood(const EvaluatedModel& a, const EvaluatedModel& b) {
  if (!std::isfinite(a.cv.error()) || !std::isfinite(b.cv.error())) {
    return false;
  }
  // Fits end with errors that are known to a thousandth: of two that are the
  // same in other words, one would always be better by less.
  constexpr double kSettled = 1e-3;
  const ErrorRatio ratio = Compare(a.cv, b.cv);
  return std::abs(ratio.log_ratio) <= std::max(ratio.std_error, kSettled);
}

std::string LikeliestChance(const DiagnosisProblem& problem,
                            const EvaluatedModel& evaluated,
                            const std::optional<Fit>& whole,
                            size_t candidates) {
  Fit fit = whole ? *whole : evaluated.fit;
  if (whole) {
    AddDiscrepancy(WithAllRuns(problem, evaluated), &fit);
  } else {
    AddDiscrepancy(*evaluated.problem, &fit);
  }
  std::string likeliest;
  double most = kSignificant;
  // Each could be any of those that are not in the model.
  const size_t tests =
      candidates - std::min(candidates, evaluated.added.size()) + 1;
  for (const auto& effect : evaluated.added) {
    const double p = tests * PValueOf(*effect, problem.model, fit);
    if (p > most) {
      most = p;
      likeliest = effect->name();
    }
  }
  return likeliest;
}

bool IsAtNoiseFloor(const EvaluatedModel& evaluated) {
  return evaluated.train_error() < NoiseFloor(evaluated.fit.train.dof) &&
         evaluated.holdout_error() < NoiseFloor(evaluated.holdout.dof);
}

std::vector<CandidateRefit> ProposeEffects(const Screening& screening) {
  std::vector<CandidateRefit> refits;
  for (size_t i = 0; i < screening.effects.size(); ++i) {
    const ScreenedEffect& effect = screening.effects[i];
    if (static_cast<int>(refits.size()) == kMostConfirmed) break;
    if (!Promises(screening, effect.predicted_error, effect.criterion)) {
      continue;
    }
    if (IsExtravagant(screening, screening.effects, effect)) continue;
    int alike = 0;
    for (const CandidateRefit& refit : refits) {
      alike += screening.confusability(i, refit.effects[0]) > 0.999 &&
               screening.confusability(refit.effects[0], i) > 0.999;
    }
    if (alike > 1) continue;
    refits.push_back(
        {{static_cast<int>(i)}, {effect}, effect.predicted_error, {}, ""});
  }
  return refits;
}

std::vector<CandidateRefit> ProposePairs(
    const Screening& screening, const std::vector<CandidateRefit>& singles) {
  // The factor by which the refit of an effect stayed above its promise.
  const auto above_promise = [&](int effect) {
    for (const CandidateRefit& single : singles) {
      if (single.effects[0] == effect && single.after) {
        return single.after->train_error() / single.predicted;
      }
    }
    return 1.0;
  };
  std::vector<CandidateRefit> refits;
  for (const Screening::Pair& pair : screening.pairs) {
    if (static_cast<int>(refits.size()) == kMostPairs) break;
    const ScreenedEffect& a = screening.effects[pair.first];
    const ScreenedEffect& b = screening.effects[pair.second];
    // Together, and not one alone.
    if (!(pair.criterion < std::min(a.criterion, b.criterion) - kClearly) ||
        !(pair.predicted_error *
              std::max({1.0, above_promise(pair.first),
                        above_promise(pair.second)}) *
              (1.0 + kMatters) <
          screening.error) ||
        IsExtravagant(screening, screening.pairs, pair)) {
      continue;
    }
    refits.push_back(
        {{pair.first, pair.second}, {a, b}, pair.predicted_error, {}, ""});
  }
  return refits;
}

void Refitter::Confirm(const EvaluatedModel& before,
                       std::vector<CandidateRefit>* refits) const {
  // An effect of which a part is proposed waits for it: if that reaches the
  // noise, nothing is left for the rest.
  const auto waits = [&](const CandidateRefit& refit) {
    return std::any_of(
        refits->begin(), refits->end(), [&](const CandidateRefit& part) {
          return refit.effects.size() == 1 && part.effects.size() == 1 &&
                 IsPartOf(*part.expected[0].effect, *refit.expected[0].effect);
        });
  };
  std::vector<bool> late;
  for (const CandidateRefit& refit : *refits) late.push_back(waits(refit));
  std::vector<CandidateRefit> first, waiting;
  for (size_t i = 0; i < refits->size(); ++i) {
    (late[i] ? waiting : first).push_back(std::move((*refits)[i]));
  }
  RefitProposals(problem_, candidates_, before, &first);
  const int best = Choose(first);
  if (best < 0 || !IsAtNoiseFloor(*first[best].after)) {
    RefitProposals(problem_, candidates_, before, &waiting);
    std::move(waiting.begin(), waiting.end(), std::back_inserter(first));
  }
  *refits = std::move(first);
}

Screening Refitter::SeenFrom(const CandidateRefit& refit) const {
  const EvaluatedModel& after = *refit.after;
  if (refit.effects.size() != 1 || IsDoubtful(after.fit)) return {};
  std::map<std::string, double> back;
  for (const ExpectedParameter& p : refit.expected[0].parameters) {
    back[p.name] = p.null_value;
  }
  const LinearizedFit without(*after.problem, after.fit.point, back);
  if (!without.Valid()) return {};
  return ScreenEffects(without, after.fit.model, candidates_, problem_.known);
}

void Refitter::AddWholes(const Screening& screening,
                         const EvaluatedModel& before, int best,
                         std::vector<CandidateRefit>* refits) const {
  const double near = kNear * (*refits)[best].after->train_error();
  std::set<int> tried;
  for (const CandidateRefit& refit : *refits) {
    if (refit.effects.size() == 1) tried.insert(refit.effects[0]);
  }
  std::vector<CandidateRefit> wholes;
  for (size_t i = 0; i < refits->size(); ++i) {
    const CandidateRefit& part = (*refits)[i];
    if (static_cast<int>(i) == best || part.effects.size() != 1 ||
        !part.accepted() || !(part.after->train_error() < near)) {
      continue;
    }
    const Effect& own = *part.expected[0].effect;
    const auto is_whole = [&](const ScreenedEffect& effect) {
      return IsPartOf(own, *effect.effect) &&
             !tried.contains(screening.IndexOf(effect.name()));
    };
    if (std::none_of(screening.effects.begin(), screening.effects.end(),
                     is_whole)) {
      continue;
    }
    for (const ScreenedEffect& effect : SeenFrom(part).effects) {
      const int e = screening.IndexOf(effect.name());
      if (e < 0 || !is_whole(effect) ||
          !(effect.predicted_error * (1.0 + kMatters) <
            part.after->train_error())) {
        continue;
      }
      tried.insert(e);
      wholes.push_back(
          {{e}, {effect}, screening.effects[e].predicted_error, {}, ""});
    }
  }
  RefitProposals(problem_, candidates_, before, &wholes);
  std::move(wholes.begin(), wholes.end(), std::back_inserter(*refits));
}

void Refitter::AddRivals(const Screening& screening,
                         const EvaluatedModel& before, int best,
                         std::vector<CandidateRefit>* refits) const {
  constexpr size_t kMostRivals = 3;
  const CandidateRefit& found = (*refits)[best];
  const EvaluatedModel& after = *found.after;
  const Screening seen = SeenFrom(found);
  std::vector<CandidateRefit> rivals;
  for (const ScreenedEffect& effect : seen.effects) {
    if (rivals.size() == kMostRivals) break;
    if (!(effect.predicted_error < kNear * after.train_error()) ||
        IsPartOf(*found.expected[0].effect, *effect.effect)) {
      continue;
    }
    const int e = screening.IndexOf(effect.name());
    if (e < 0) continue;
    const bool tried = std::any_of(
        refits->begin(), refits->end(), [&](const CandidateRefit& refit) {
          return refit.effects == std::vector<int>{e} &&
                 (refit.refused.empty() && AreAsGood(*refit.after, after));
        });
    if (tried) continue;
    rivals.push_back(
        {{e}, {effect}, screening.effects[e].predicted_error, {}, ""});
  }
  RefitProposals(problem_, candidates_, before, &rivals);
  for (CandidateRefit& rival : rivals) {
    const auto same = std::find_if(refits->begin(), refits->end(),
                                   [&](const CandidateRefit& refit) {
                                     return refit.effects == rival.effects;
                                   });
    if (same == refits->end()) {
      refits->push_back(std::move(rival));
    } else if (rival.after->cv.error() < same->after->cv.error()) {
      *same = std::move(rival);
    }
  }
}

int Refitter::Choose(const std::vector<CandidateRefit>& refits) const {
  int best = -1;
  for (size_t i = 0; i < refits.size(); ++i) {
    if (refits[i].refused.empty() &&
        (best < 0 || IsBetter(*refits[i].after, *refits[best].after))) {
      best = static_cast<int>(i);
    }
  }
  return best;
}

// The one with fewer parameters, unless it is worse. Of as many parameters the
// more common kind, where neither predicts better.
bool Refitter::IsBetter(const EvaluatedModel& a,
                        const EvaluatedModel& b) const {
  const size_t parameters_a = a.fit.parameters.size();
  const size_t parameters_b = b.fit.parameters.size();
  if (parameters_a < parameters_b) return !IsWorse(a.cv, b.cv);
  if (parameters_b < parameters_a) return IsWorse(b.cv, a.cv);
  const int rarity_a = Rarity(a), rarity_b = Rarity(b);
  return AreAsGood(a, b) && rarity_a != rarity_b ? rarity_a < rarity_b
                                                 : a.cv.error() < b.cv.error();
}

// How far down the catalogue the kinds of its effects are, which goes from the
// common to the rare.
int Refitter::Rarity(const EvaluatedModel& evaluated) const {
  int rarity = 0;
  for (const auto& effect : evaluated.added) {
    const auto at = std::find_if(
        candidates_.begin(), candidates_.end(),
        [&](const auto& c) { return c->kind() == effect->kind(); });
    rarity += static_cast<int>(at - candidates_.begin());
  }
  return rarity;
}

}  // namespace sysid
