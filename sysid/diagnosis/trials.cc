#include "sysid/diagnosis/trials.h"

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

// Whether all of an effect's parameters are also another's, which has more.
bool IsPartOf(const Effect& effect, const Effect& other) {
  const std::vector<std::string> part = effect.ParameterNames();
  const std::vector<std::string> all = other.ParameterNames();
  return part.size() < all.size() &&
         std::all_of(part.begin(), part.end(), [&](const std::string& name) {
           return std::find(all.begin(), all.end(), name) != all.end();
         });
}

// Whether a part of the effect is as good: that one first, and what the effect
// adds to it later.
bool IsExtravagant(const Screening& screening, const ScreenedEffect& effect) {
  return std::any_of(screening.effects.begin(), screening.effects.end(),
                     [&](const ScreenedEffect& other) {
                       return IsPartOf(*other.effect, *effect.effect) &&
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

// The values of an effect's own parameters in a judged model.
std::vector<double> OwnValues(const Judgement& judgement,
                              const Effect& effect) {
  const Model& model = judgement.fit.model;
  std::vector<double> values;
  for (const EffectParameter& own : effect.parameters()) {
    for (size_t i = 0; i < model.effects().parameters().size(); ++i) {
      if (model.effects().parameters()[i].name == own.name) {
        values.push_back(model.nominal().effects[i]);
      }
    }
  }
  return values;
}

// Whether a refit tells of an effect: some parameter is clearly off its null,
// or the errors are clearly lower where standard errors cannot say.
bool IsTold(const Judgement& before, const Judgement& judgement,
            const ScreenedEffect& effect) {
  constexpr double kDeviations = 3.0;
  constexpr double kMuch = 0.5;
  // Where the rest of the model is still wrong its standard errors say little.
  bool hidden = judgement.train_error() < kMuch * before.train_error();
  for (const ParameterEstimate& p : judgement.fit.parameters) {
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
  return hidden && !AreAsGood(before, judgement);
}

// The effect in a model of which another is an extension, or null.
const Effect* FindPart(const Model& model, const Effect& whole) {
  for (int i = 0; i < model.effects().size(); ++i) {
    const Effect& effect = model.effects().effect(i);
    if (IsPartOf(effect, whole)) return &effect;
  }
  return nullptr;
}

std::string WhyRefused(const Judgement& before, const Trial& trial) {
  // A law with more parameters gains something on most machines. Where the one
  // that is in the model has reached the noise, that is no effect that is
  // missing.
  constexpr double kReached = 1.1;
  const Judgement& after = *trial.after;
  for (const ScreenedEffect& effect : trial.expected) {
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
  for (const ScreenedEffect& effect : trial.expected) {
    if (!IsTold(before, after, effect)) {
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

// Whether a model's effects are part of another's, which has more.
bool IsWithin(const Judgement& judgement, const Judgement& other) {
  const auto names = [](const Judgement& j) {
    std::set<std::string> all;
    for (const auto& effect : j.added) {
      const std::vector<std::string> own = effect->ParameterNames();
      all.insert(own.begin(), own.end());
    }
    return all;
  };
  const std::set<std::string> part = names(judgement), whole = names(other);
  return part.size() < whole.size() &&
         std::includes(whole.begin(), whole.end(), part.begin(), part.end());
}

}  // namespace

std::string WhyImplausible(const Judgement& judgement) {
  for (const auto& effect : judgement.added) {
    const std::string why = effect->Implausible(OwnValues(judgement, *effect));
    if (!why.empty()) return effect->name() + ": " + why;
  }
  return "";
}

bool AreAsGood(const Judgement& a, const Judgement& b) {
  constexpr double kMost = 0.25;  // of the sums of squares
  const double ratio = std::abs(std::log(a.squares() / b.squares()));
  const double independent =
      a.squares() < b.squares() ? a.independent : b.independent;
  return ratio < 2 * kMaterial ||
         (ratio < kMost && independent * ratio < kClearly);
}

bool IsAtNoiseFloor(const Judgement& judgement) {
  return judgement.train_error() < NoiseFloor(judgement.fit.train.dof) &&
         judgement.holdout_error() < NoiseFloor(judgement.holdout.dof);
}

std::vector<Trial> ProposeEffects(const Screening& screening) {
  std::vector<Trial> trials;
  for (size_t i = 0; i < screening.effects.size(); ++i) {
    const ScreenedEffect& effect = screening.effects[i];
    if (static_cast<int>(trials.size()) == kMostConfirmed) break;
    if (!Promises(screening, effect.predicted_error, effect.criterion)) {
      continue;
    }
    if (IsExtravagant(screening, effect)) continue;
    int alike = 0;
    for (const Trial& trial : trials) {
      alike += screening.likeness(i, trial.effects[0]) > 0.999 &&
               screening.likeness(trial.effects[0], i) > 0.999;
    }
    if (alike > 1) continue;
    Trial trial;
    trial.effects = {static_cast<int>(i)};
    trial.expected = {effect};
    trial.predicted = effect.predicted_error;
    trials.push_back(std::move(trial));
  }
  return trials;
}

std::vector<Trial> ProposePairs(const Screening& screening) {
  std::vector<Trial> trials;
  for (const Screening::Pair& pair : screening.pairs) {
    if (static_cast<int>(trials.size()) == kMostPairs) break;
    const ScreenedEffect& a = screening.effects[pair.first];
    const ScreenedEffect& b = screening.effects[pair.second];
    // Together, and not one alone.
    if (!(pair.criterion < std::min(a.criterion, b.criterion) - kClearly) ||
        !(pair.predicted_error < (1 - kMaterial) * screening.error)) {
      continue;
    }
    Trial trial;
    trial.effects = {pair.first, pair.second};
    trial.expected = {a, b};
    trial.predicted = pair.predicted_error;
    trials.push_back(std::move(trial));
  }
  return trials;
}

void Refitter::Confirm(const Judgement& before,
                       std::vector<Trial>* trials) const {
  // An effect of which a part is proposed waits for it: if that reaches the
  // noise, nothing is left for the rest.
  const auto waits = [&](const Trial& trial) {
    return std::any_of(trials->begin(), trials->end(), [&](const Trial& part) {
      return trial.effects.size() == 1 && part.effects.size() == 1 &&
             IsPartOf(*part.expected[0].effect, *trial.expected[0].effect);
    });
  };
  std::vector<bool> late;
  for (const Trial& trial : *trials) late.push_back(waits(trial));
  std::vector<Trial> first, waiting;
  for (size_t i = 0; i < trials->size(); ++i) {
    (late[i] ? waiting : first).push_back(std::move((*trials)[i]));
  }
  Refit(before, &first);
  const int best = Choose(first);
  if (best < 0 || !IsAtNoiseFloor(*first[best].after)) {
    Refit(before, &waiting);
    std::move(waiting.begin(), waiting.end(), std::back_inserter(first));
  }
  *trials = std::move(first);
}

void Refitter::Refit(const Judgement& before,
                     std::vector<Trial>* trials) const {
  const int count = static_cast<int>(trials->size());
  if (count == 0) return;
  EstimationOptions options = problem_.options;
  options.progress = nullptr;
  const int threads = std::max(1, std::min(count, problem_.options.threads));
  options.threads = std::max(1, problem_.options.threads / threads);
  options.max_iterations = kTrialIterations;
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
    Trial& trial = (*trials)[i];
    std::vector<const ScreenedEffect*> effects;
    for (const ScreenedEffect& e : trial.expected) effects.push_back(&e);
    trial.after =
        JudgeWith(problem_, before, effects, Coarse(options, trial.predicted));
    trial.refused = WhyRefused(before, trial);
    const std::lock_guard lock(mutex);
    ++done;
    report();
    return true;
  });
}

// What else could stand in the place of the best effect: with that one back at
// null to first order, seen from the trajectories that it led to, which are
// much nearer to the truth than those of the model before.
void Refitter::AddRivals(const Screening& screening, const Judgement& before,
                         int best, std::vector<Trial>* trials) const {
  constexpr size_t kMostRivals = 3;
  constexpr double kNear = 1.5;  // times the error of the best
  const Trial& found = (*trials)[best];
  const Judgement& after = *found.after;
  if (found.effects.size() != 1 || IsDoubtful(after.fit)) return;
  std::map<std::string, double> back;
  for (const ExpectedParameter& p : found.expected[0].parameters) {
    back[p.name] = p.null_value;
  }
  const LinearizedFit without(*after.problem, after.fit.point, back);
  if (!without.Valid()) return;
  const Screening seen =
      ScreenEffects(without, after.fit.model, candidates_, problem_.known);
  std::vector<Trial> rivals;
  for (const ScreenedEffect& effect : seen.effects) {
    if (rivals.size() == kMostRivals) break;
    if (!(effect.predicted_error < kNear * after.train_error()) ||
        IsPartOf(*found.expected[0].effect, *effect.effect)) {
      continue;
    }
    const int e = screening.IndexOf(effect.name());
    if (e < 0) continue;
    const bool tried =
        std::any_of(trials->begin(), trials->end(), [&](const Trial& trial) {
          return trial.effects == std::vector<int>{e} &&
                 (trial.refused.empty() && AreAsGood(*trial.after, after));
        });
    if (tried) continue;
    Trial trial;
    trial.effects = {e};
    trial.expected = {effect};
    trial.predicted = screening.effects[e].predicted_error;
    rivals.push_back(std::move(trial));
  }
  Refit(before, &rivals);
  for (Trial& rival : rivals) {
    const auto same = std::find_if(
        trials->begin(), trials->end(),
        [&](const Trial& trial) { return trial.effects == rival.effects; });
    if (same == trials->end()) {
      trials->push_back(std::move(rival));
    } else if (rival.after->squares() < same->after->squares()) {
      *same = std::move(rival);
    }
  }
}

int Refitter::Choose(const std::vector<Trial>& trials) const {
  int best = -1;
  for (size_t i = 0; i < trials.size(); ++i) {
    if (!trials[i].refused.empty()) continue;
    if (best < 0) {
      best = static_cast<int>(i);
      continue;
    }
    if (IsBetter(*trials[i].after, *trials[best].after)) {
      best = static_cast<int>(i);
    }
  }
  return best;
}

// Of two at the noise, the one that is part of the other: no law is refined to
// fit what is left there. Of two that are as good, the one with fewer
// parameters, then the more common kind.
bool Refitter::IsBetter(const Judgement& a, const Judgement& b) const {
  if (IsAtNoiseFloor(a) && IsAtNoiseFloor(b)) {
    if (IsWithin(a, b)) return true;
    if (IsWithin(b, a)) return false;
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
int Refitter::Rarity(const Judgement& judgement) const {
  int rarity = 0;
  for (const auto& effect : judgement.added) {
    const auto at = std::find_if(
        candidates_.begin(), candidates_.end(),
        [&](const auto& c) { return c->kind() == effect->kind(); });
    rarity += static_cast<int>(at - candidates_.begin());
  }
  return rarity;
}

}  // namespace sysid
