#include "sysid/diagnosis/candidate_refits.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <utility>

#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

// In units of the variance that remains, the drop of the held-out sum of
// squares that is no chance.
constexpr double kHoldoutDrop = 9.0;
constexpr int kMostConfirmed = 6;  // candidates that are refitted in a round
constexpr int kMostPairs = 5;

// The largest normalised error that may still be noise, with `dof` numbers:
// three standard deviations above 1.1.
double NoiseFloor(double dof) { return 1.1 + 3.0 * std::sqrt(0.5 / dof); }

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

// Whether a part of the effect is as good: that one first, and what the effect
// adds to it later.
bool IsExtravagant(const Screening& screening, const ScreenedEffect& effect) {
  return std::any_of(screening.effects.begin(), screening.effects.end(),
                     [&](const ScreenedEffect& other) {
                       return ArePartOf({other.effect.get()},
                                        {effect.effect.get()}) &&
                              other.criterion < effect.criterion + kClearly;
                     });
}

// Whether a refit is worth its time: the screening is clear, or it promises so
// much that the held-out runs should judge (where much else is missing, few
// samples are independent, and nothing is clear).
bool Promises(const Screening& screening, double predicted, double criterion) {
  constexpr double kMuch = 0.9;
  return (criterion < -kClearly &&
          predicted < (1 - kMaterial) * screening.error) ||
         predicted < kMuch * screening.error;
}

// Whether a refit tells of an effect: some parameter is clearly off its null,
// or the errors are clearly lower where standard errors cannot say.
bool IsIdentified(const EvaluatedModel& before, const EvaluatedModel& evaluated,
                  const ScreenedEffect& effect) {
  constexpr double kDeviations = 3.0;
  constexpr double kMuch = 0.5;
  // Where the rest of the model is still wrong its standard errors say little.
  bool hidden = evaluated.train_error() < kMuch * before.train_error();
  for (const ParameterEstimate& p : evaluated.fit.parameters) {
    for (const ExpectedParameter& expected : effect.parameters) {
      if (expected.name != p.name || expected.searched) continue;
      // What other parameters hide in part: only its effect on the errors says.
      if (!p.identifiable) hidden = true;
      if (p.identifiable &&
          std::abs(p.value - expected.null_value) > kDeviations * p.std_error) {
        return true;
      }
    }
  }
  return hidden && !AreAsGood(before, evaluated);
}

// The effect in a model of which another is an extension, or null.
const Effect* FindPart(const Model& model, const Effect& whole) {
  for (int i = 0; i < model.effects().size(); ++i) {
    const Effect& effect = model.effects().effect(i);
    if (ArePartOf({&effect}, {&whole})) return &effect;
  }
  return nullptr;
}

std::string WhyRefused(const EvaluatedModel& before,
                       const CandidateRefit& refit) {
  // A law with more parameters gains something on most machines. Where the one
  // that is in the model has reached the noise, that is no effect that is
  // missing.
  constexpr double kReached = 1.1;
  const EvaluatedModel& after = *refit.after;
  for (const ScreenedEffect& effect : refit.expected) {
    const Effect* part = FindPart(before.fit.model, *effect.effect);
    if (part != nullptr && before.train_error() < kReached &&
        before.holdout_error() < kReached) {
      return part->name() + " reaches the noise without it";
    }
  }
  if (!std::isfinite(after.train_error()) ||
      !std::isfinite(after.holdout_error())) {
    return "the motion does not stay finite with it";
  }
  if (!(after.train_error() < (1 - kMaterial) * before.train_error())) {
    return "refitted it gains nothing";
  }
  for (const ScreenedEffect& effect : refit.expected) {
    if (!IsIdentified(before, after, effect)) {
      return "refitted, " + effect.name() +
             " is within three standard errors of none";
    }
  }
  const std::string implausible = WhyImplausible(after);
  if (!implausible.empty()) return implausible;
  const double variance =
      std::max(1.0, after.holdout.squares / after.holdout.dof);
  const double drop =
      (before.holdout.squares - after.holdout.squares) / variance;
  if (!(drop > kHoldoutDrop)) {
    return "it does not lower the error of the held-out runs";
  }
  return "";
}

std::vector<const Effect*> AddedTo(const EvaluatedModel& evaluated) {
  std::vector<const Effect*> effects;
  for (const auto& effect : evaluated.added) effects.push_back(effect.get());
  return effects;
}

}  // namespace

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

bool AreAsGood(const EvaluatedModel& a, const EvaluatedModel& b) {
  constexpr double kMost = 0.25;  // of the sums of squares
  const double ratio = std::abs(std::log(a.squares() / b.squares()));
  const double independent =
      a.squares() < b.squares() ? a.independent : b.independent;
  return ratio < 2 * kMaterial ||
         (ratio < kMost && independent * ratio < kClearly);
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
    if (IsExtravagant(screening, effect)) continue;
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

std::vector<CandidateRefit> ProposePairs(const Screening& screening) {
  std::vector<CandidateRefit> refits;
  for (const Screening::Pair& pair : screening.pairs) {
    if (static_cast<int>(refits.size()) == kMostPairs) break;
    const ScreenedEffect& a = screening.effects[pair.first];
    const ScreenedEffect& b = screening.effects[pair.second];
    // Together, and not one alone.
    if (!(pair.criterion < std::min(a.criterion, b.criterion) - kClearly) ||
        !(pair.predicted_error < (1 - kMaterial) * screening.error)) {
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
                 ArePartOf({part.expected[0].effect.get()},
                           {refit.expected[0].effect.get()});
        });
  };
  std::vector<bool> late;
  for (const CandidateRefit& refit : *refits) late.push_back(waits(refit));
  std::vector<CandidateRefit> first, waiting;
  for (size_t i = 0; i < refits->size(); ++i) {
    (late[i] ? waiting : first).push_back(std::move((*refits)[i]));
  }
  Refit(before, &first);
  const int best = Choose(first);
  if (best < 0 || !IsAtNoiseFloor(*first[best].after)) {
    Refit(before, &waiting);
    std::move(waiting.begin(), waiting.end(), std::back_inserter(first));
  }
  *refits = std::move(first);
}

void Refitter::Refit(const EvaluatedModel& before,
                     std::vector<CandidateRefit>* refits) const {
  const int count = static_cast<int>(refits->size());
  if (count == 0) return;
  EstimationOptions options = problem_.options;
  options.progress = nullptr;
  const int threads = std::max(1, std::min(count, problem_.options.threads));
  options.threads = std::max(1, problem_.options.threads / threads);
  options.max_iterations = kRefitIterations;
  std::mutex mutex;
  int done = 0;
  const auto report = [&] {
    if (!problem_.options.progress) return;
    problem_.options.progress(
        {"refitting " + std::to_string(count) + " candidates", done, count,
         before.train_error()});
  };
  report();
  ParallelFor(count, threads, [&](int i) {
    CandidateRefit& refit = (*refits)[i];
    std::vector<const ScreenedEffect*> effects;
    for (const ScreenedEffect& e : refit.expected) effects.push_back(&e);
    refit.after = EvaluateWith(problem_, before, effects,
                               Coarse(options, refit.predicted));
    refit.refused = WhyRefused(before, refit);
    const std::lock_guard lock(mutex);
    ++done;
    report();
    return true;
  });
}

// What else could stand in the place of the best effect: with that one back at
// null to first order, seen from the trajectories that it led to, which are
// much nearer to the truth than those of the model before.
void Refitter::AddRivals(const Screening& screening,
                         const EvaluatedModel& before, int best,
                         std::vector<CandidateRefit>* refits) const {
  constexpr size_t kMostRivals = 3;
  constexpr double kNear = 1.5;  // times the error of the best
  const CandidateRefit& found = (*refits)[best];
  const EvaluatedModel& after = *found.after;
  if (found.effects.size() != 1 || IsDoubtful(after.fit)) return;
  std::map<std::string, double> back;
  for (const ExpectedParameter& p : found.expected[0].parameters) {
    back[p.name] = p.null_value;
  }
  const LinearizedFit without(*after.problem, after.fit.point, back);
  if (!without.Valid()) return;
  const Screening seen =
      ScreenEffects(without, after.fit.model, candidates_, problem_.known);
  std::vector<CandidateRefit> rivals;
  for (const ScreenedEffect& effect : seen.effects) {
    if (rivals.size() == kMostRivals) break;
    if (!(effect.predicted_error < kNear * after.train_error()) ||
        ArePartOf({found.expected[0].effect.get()}, {effect.effect.get()})) {
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
  Refit(before, &rivals);
  for (CandidateRefit& rival : rivals) {
    const auto same = std::find_if(refits->begin(), refits->end(),
                                   [&](const CandidateRefit& refit) {
                                     return refit.effects == rival.effects;
                                   });
    if (same == refits->end()) {
      refits->push_back(std::move(rival));
    } else if (rival.after->squares() < same->after->squares()) {
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

// Of two at the noise, the one that is part of the other: no law is refined to
// fit what is left there. Of two that are as good, the one with fewer
// parameters, then the more common kind.
bool Refitter::IsBetter(const EvaluatedModel& a,
                        const EvaluatedModel& b) const {
  if (IsAtNoiseFloor(a) && IsAtNoiseFloor(b)) {
    if (ArePartOf(AddedTo(a), AddedTo(b))) return true;
    if (ArePartOf(AddedTo(b), AddedTo(a))) return false;
  }
  if (!AreAsGood(a, b)) return a.squares() < b.squares();
  const size_t parameters_a = a.fit.parameters.size();
  const size_t parameters_b = b.fit.parameters.size();
  if (parameters_a != parameters_b) return parameters_a < parameters_b;
  const int rarity_a = Rarity(a), rarity_b = Rarity(b);
  return rarity_a != rarity_b ? rarity_a < rarity_b : a.squares() < b.squares();
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
