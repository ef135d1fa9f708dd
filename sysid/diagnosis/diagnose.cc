#include "sysid/diagnosis/diagnose.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "models/error.h"
#include "sysid/estimation/parallel.h"
#include "sysid/estimation/segmentation.h"

namespace sysid {
namespace {

constexpr double kSignificant = 0.01;  // of a p-value, which pays for all tests
// An effect must lower the training error by this part of it: less is of no use
// even where it is certain.
constexpr double kMaterial = 0.01;
// In units of the variance that remains, the drop of the held-out sum of
// squares that is no chance.
constexpr double kHoldoutDrop = 9.0;
// A candidate that would explain this part of what another does may stand for
// it.
constexpr double kAlike = 0.9;
// Of the screening's criterion: twice a log-likelihood.
constexpr double kClearly = 10.0;
// Iterations of a refit that is to be judged, not kept.
constexpr int kTrialIterations = 25;
constexpr int kMostConfirmed = 6;  // candidates that are refitted in a round
constexpr int kMostPairs = 5;
constexpr size_t kMostExchanged = 2;
constexpr int kMostSteps = 8;
// An effect that explains less of the excess over the noise is not what is
// missing.
constexpr double kExplains = 0.2;

// The refit of one proposal: one effect or two.
struct Trial {
  std::vector<int> effects;  // in the screening
  // Those effects as they are expected: by the screening, or by a better one.
  std::vector<ScreenedEffect> expected;
  double predicted = 0.0;
  std::optional<Judgement> after;
  std::string refused;  // empty: accepted
};

// Whether neither of two models is clearly the better: by their likelihoods, of
// as many samples as are independent under the better one (of a model that
// misses much those are few, so only up to a limit), or by too little to
// matter.
bool AreAsGood(const Judgement& a, const Judgement& b) {
  constexpr double kMost = 0.25;  // of the sums of squares
  const double ratio = std::abs(std::log(a.squares() / b.squares()));
  const double independent =
      a.squares() < b.squares() ? a.independent : b.independent;
  return ratio < 2 * kMaterial ||
         (ratio < kMost && independent * ratio < kClearly);
}

// The largest normalised error that may still be noise, with `dof` numbers:
// three standard deviations above 1.1.
double NoiseFloor(double dof) { return 1.1 + 3.0 * std::sqrt(0.5 / dof); }

bool IsAtNoiseFloor(const Judgement& judgement) {
  return judgement.train_error() < NoiseFloor(judgement.fit.train.dof) &&
         judgement.holdout_error() < NoiseFloor(judgement.holdout.dof);
}

class Search {
 public:
  Search(const DiagnosisProblem& problem,
         const std::vector<std::shared_ptr<const Effect>>& candidates,
         const DiagnosisOptions& options)
      : problem_(problem), candidates_(candidates), options_(options) {}

  Diagnosis Run();

 private:
  void Report(const std::string& doing, int step, int of, double error) const;
  Screening Screen(const Judgement& judgement) const;
  std::vector<Trial> Propose(const Screening& screening) const;
  std::vector<Trial> ProposePairs(const Screening& screening) const;
  void Confirm(const Judgement& before, std::vector<Trial>* trials) const;
  void Refit(const Judgement& before, std::vector<Trial>* trials) const;
  void AddRivals(const Screening& screening, const Judgement& before, int best,
                 std::vector<Trial>* trials) const;
  // The best of the accepted, -1 where none is.
  int Choose(const std::vector<Trial>& trials) const;
  bool IsBetter(const Judgement& a, const Judgement& b) const;
  int Rarity(const Judgement& judgement) const;
  void List(const Screening& screening, std::vector<Trial>* trials, int best,
            Diagnosis* diagnosis) const;
  bool LookBack(const std::vector<std::string>& newest, Judgement* now,
                std::vector<DiagnosisStep>* steps) const;
  Verdict Decide(const Judgement& judgement, const Trial* best) const;
  void Doubt(Diagnosis* diagnosis) const;
  void Shorten(Diagnosis* diagnosis) const;
  std::optional<Judgement> Lengthen(const Judgement& now) const;

  const DiagnosisProblem& problem_;
  const std::vector<std::shared_ptr<const Effect>>& candidates_;
  const DiagnosisOptions& options_;
};

void Search::Report(const std::string& doing, int step, int of,
                    double error) const {
  if (problem_.options.progress) {
    problem_.options.progress({doing, step, of, error});
  }
}

Screening Search::Screen(const Judgement& judgement) const {
  Report("screening " + std::to_string(candidates_.size()) + " effects", 0, 0,
         judgement.train_error());
  if (!IsDoubtful(judgement.fit)) {
    const LinearizedFit linearized(*judgement.problem, judgement.fit.point);
    if (!linearized.Valid()) return {};
    return ScreenEffects(linearized, judgement.fit.model, candidates_,
                         problem_.known);
  }
  // Parameters that ran away for want of an effect are no place to look from:
  // from where they started.
  const Fit start = StatesAtStart(judgement.problem.get(), judgement.fit.point);
  const LinearizedFit linearized(*judgement.problem, start.point);
  if (!linearized.Valid()) return {};
  return ScreenEffects(linearized, start.model, candidates_, problem_.known);
}

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

// The best by the screening; of those that explain the same, two.
std::vector<Trial> Search::Propose(const Screening& screening) const {
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

std::vector<Trial> Search::ProposePairs(const Screening& screening) const {
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

// Why some effect that was added is not what it means; empty where all are.
std::string WhyImplausible(const Judgement& judgement) {
  for (const auto& effect : judgement.added) {
    const std::string why = effect->Implausible(OwnValues(judgement, *effect));
    if (!why.empty()) return effect->name() + ": " + why;
  }
  return "";
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

std::string WhyRefused(const Judgement& before, const Trial& trial) {
  const Judgement& after = *trial.after;
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

void Search::Confirm(const Judgement& before,
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

void Search::Refit(const Judgement& before, std::vector<Trial>* trials) const {
  const int count = static_cast<int>(trials->size());
  if (count == 0) return;
  EstimationOptions options = problem_.options;
  options.progress = nullptr;
  const int threads = std::max(1, std::min(count, problem_.options.threads));
  options.threads = std::max(1, problem_.options.threads / threads);
  options.max_iterations = kTrialIterations;
  Report("refitting " + std::to_string(count) + " candidates", 0, count,
         before.train_error());
  ParallelFor(count, threads, [&](int i) {
    Trial& trial = (*trials)[i];
    std::vector<const ScreenedEffect*> effects;
    for (const ScreenedEffect& e : trial.expected) effects.push_back(&e);
    trial.after =
        JudgeWith(problem_, before, effects, Coarse(options, trial.predicted));
    trial.refused = WhyRefused(before, trial);
    return true;
  });
}

// What else could stand in the place of the best effect: with that one back at
// null to first order, seen from the trajectories that it led to, which are
// much nearer to the truth than those of the model before.
void Search::AddRivals(const Screening& screening, const Judgement& before,
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
    const auto at = std::find_if(
        screening.effects.begin(), screening.effects.end(),
        [&](const ScreenedEffect& e) { return e.name() == effect.name(); });
    if (at == screening.effects.end()) continue;
    const int e = static_cast<int>(at - screening.effects.begin());
    const bool tried =
        std::any_of(trials->begin(), trials->end(), [&](const Trial& trial) {
          return trial.effects == std::vector<int>{e} &&
                 (trial.refused.empty() && AreAsGood(*trial.after, after));
        });
    if (tried) continue;
    Trial trial;
    trial.effects = {e};
    trial.expected = {effect};
    trial.predicted = at->predicted_error;
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

int Search::Choose(const std::vector<Trial>& trials) const {
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

// Of two that are as good, the one with fewer parameters, then the more common
// kind.
bool Search::IsBetter(const Judgement& a, const Judgement& b) const {
  if (!AreAsGood(a, b)) return a.squares() < b.squares();
  const size_t parameters_a = a.fit.parameters.size();
  const size_t parameters_b = b.fit.parameters.size();
  if (parameters_a != parameters_b) return parameters_a < parameters_b;
  const int rarity_a = Rarity(a), rarity_b = Rarity(b);
  return rarity_a != rarity_b ? rarity_a < rarity_b : a.squares() < b.squares();
}

// How far down the catalogue the kinds of its effects are, which goes from the
// common to the rare.
int Search::Rarity(const Judgement& judgement) const {
  int rarity = 0;
  for (const auto& effect : judgement.added) {
    const auto at = std::find_if(
        candidates_.begin(), candidates_.end(),
        [&](const auto& c) { return c->kind() == effect->kind(); });
    rarity += static_cast<int>(at - candidates_.begin());
  }
  return rarity;
}

// The effects' own estimates of a judgement.
std::vector<ParameterEstimate> EstimatesOf(
    const Judgement& judgement, const std::vector<const Effect*>& effects) {
  std::vector<ParameterEstimate> estimates;
  for (const Effect* effect : effects) {
    for (const std::string& name : effect->ParameterNames()) {
      for (const ParameterEstimate& p : judgement.fit.parameters) {
        if (p.name == name) estimates.push_back(p);
      }
    }
  }
  return estimates;
}

bool StandsOut(const CandidateEffect& candidate) {
  return candidate.screened.criterion < -kClearly ||
         (candidate.confirmed && candidate.confirmed->accepted);
}

void Search::List(const Screening& screening, std::vector<Trial>* trials,
                  int best, Diagnosis* diagnosis) const {
  // The chosen first, then the accepted, the refused, and the rest as screened.
  std::vector<int> order;
  for (size_t i = 0; i < trials->size(); ++i)
    order.push_back(static_cast<int>(i));
  const auto rank = [&](int i) {
    return i == best ? 0 : (*trials)[i].refused.empty() ? 1 : 2;
  };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    if (rank(a) != rank(b)) return rank(a) < rank(b);
    return (*trials)[a].after->squares() < (*trials)[b].after->squares();
  });
  std::vector<bool> listed(screening.effects.size(), false);
  std::vector<int> source;  // in the screening
  const auto list = [&](int e) {
    if (listed[e]) return false;
    listed[e] = true;
    source.push_back(e);
    diagnosis->candidates.emplace_back();
    diagnosis->candidates.back().screened = screening.effects[e];
    return true;
  };
  for (const int t : order) {
    const Trial& trial = (*trials)[t];
    for (size_t k = 0; k < trial.effects.size(); ++k) {
      if (!list(trial.effects[k])) continue;
      CandidateEffect& candidate = diagnosis->candidates.back();
      Confirmation confirmed;
      confirmed.train = trial.after->train_error();
      confirmed.holdout = trial.after->holdout_error();
      confirmed.parameters =
          EstimatesOf(*trial.after, {candidate.screened.effect.get()});
      confirmed.accepted = trial.refused.empty();
      confirmed.refused = trial.refused;
      if (trial.effects.size() == 2) {
        confirmed.together_with =
            screening.effects[trial.effects[1 - k]].name();
      }
      candidate.confirmed = confirmed;
    }
  }
  for (size_t i = 0; i < screening.effects.size(); ++i) {
    list(static_cast<int>(i));
  }
  diagnosis->proposed.clear();
  if (best >= 0) {
    for (const int e : (*trials)[best].effects) {
      diagnosis->proposed.push_back(screening.effects[e].name());
    }
  }
  // Which of them the data cannot tell apart: they would explain the same, and
  // where both were refitted they do so equally well.
  const auto accepted = [&](int e) -> const Judgement* {
    for (const Trial& trial : *trials) {
      if (trial.effects == std::vector<int>{e} && trial.refused.empty()) {
        return &*trial.after;
      }
    }
    return nullptr;
  };
  const auto refused = [&](int e) {
    return std::any_of(trials->begin(), trials->end(), [&](const Trial& t) {
      return t.effects == std::vector<int>{e} && !t.refused.empty();
    });
  };
  for (size_t a = 0; a < source.size(); ++a) {
    CandidateEffect& candidate = diagnosis->candidates[a];
    if (!StandsOut(candidate)) continue;
    for (size_t b = 0; b < source.size(); ++b) {
      const CandidateEffect& other = diagnosis->candidates[b];
      if (a == b || !StandsOut(other)) continue;
      if (refused(source[a]) != refused(source[b])) continue;
      const double like = screening.likeness(source[a], source[b]);
      const Judgement* ours = accepted(source[a]);
      const Judgement* theirs = accepted(source[b]);
      // Where both were refitted, by that; else to first order.
      const bool same =
          ours != nullptr && theirs != nullptr
              ? AreAsGood(*ours, *theirs) &&
                    (like > kAlike || IsAtNoiseFloor(*ours))
              : like > 0.999 || (like > kAlike &&
                                 std::abs(candidate.screened.criterion -
                                          other.screened.criterion) < kClearly);
      if (!same) continue;
      candidate.indistinguishable_from.push_back(other.screened.name());
      if (!candidate.told_apart_by.empty()) continue;
      candidate.told_apart_by =
          like > 1 - 1e-6 && screening.likeness(source[b], source[a]) > 1 - 1e-6
              ? "in this mechanism, as it stands, both do the same in every "
                "motion like these; " +
                    candidate.screened.name() + " shows in " +
                    candidate.screened.effect->ShowsIn()
              : candidate.screened.name() + " shows in " +
                    candidate.screened.effect->ShowsIn() + "; " +
                    other.screened.name() + " in " +
                    other.screened.effect->ShowsIn();
    }
  }
}

// Takes out what the newest effects made useless, and exchanges what another
// candidate now does better. True where it changed the model.
bool Search::LookBack(const std::vector<std::string>& newest, Judgement* now,
                      std::vector<DiagnosisStep>* steps) const {
  bool any = false;
  std::vector<std::string> older;
  for (const auto& effect : now->added) {
    if (std::find(newest.begin(), newest.end(), effect->name()) ==
        newest.end()) {
      older.push_back(effect->name());
    }
  }
  for (const std::string& name : older) {
    Report("looking back at " + name, 0, 0, now->train_error());
    EstimationOptions options = Coarse(problem_.options, now->train_error());
    options.progress = nullptr;
    options.max_iterations = kTrialIterations;
    Judgement without = JudgeWithout(problem_, *now, name, options);
    if (!std::isfinite(without.train_error())) continue;
    DiagnosisStep step;
    step.removed = name;
    step.segment_s = now->fit.segment_s;
    step.train_before = now->train_error();
    step.holdout_before = now->holdout_error();
    const bool needed =
        !WhyImplausible(without).empty() ||
        without.squares() > (1 + 2 * kMaterial) * now->squares();
    if (!needed) {
      step.predicted = without.train_error();
      *now = std::move(without);
    } else {
      const Screening screening = Screen(without);
      std::vector<Trial> trials = Propose(screening);
      std::erase_if(trials, [&](const Trial& trial) {
        return screening.effects[trial.effects[0]].name() == name;
      });
      if (trials.size() > kMostExchanged) trials.resize(kMostExchanged);
      Confirm(without, &trials);
      const int best = Choose(trials);
      if (best < 0) continue;
      if (!IsBetter(*trials[best].after, *now)) continue;
      const Effect& effect = *screening.effects[trials[best].effects[0]].effect;
      step.effects = {effect.name()};
      step.predicted = trials[best].predicted;
      *now = std::move(*trials[best].after);
      step.parameters = EstimatesOf(*now, {&effect});
    }
    if (!now->fit.converged) *now = Rejudge(problem_, std::move(*now));
    step.train_after = now->train_error();
    step.holdout_after = now->holdout_error();
    steps->push_back(step);
    any = true;
  }
  return any;
}

Verdict Search::Decide(const Judgement& judgement, const Trial* best) const {
  if (best != nullptr) {
    const double holdout = judgement.holdout_error();
    const double excess = holdout * holdout - 1.0;
    const double left = std::pow(best->after->holdout_error(), 2) - 1.0;
    if (IsAtNoiseFloor(*best->after) || excess - left > kExplains * excess) {
      return Verdict::kMissingEffect;
    }
  }
  return IsAtNoiseFloor(judgement) ? Verdict::kAdequate : Verdict::kUnexplained;
}

void Search::Doubt(Diagnosis* diagnosis) const {
  const Fit& fit = diagnosis->base.fit;
  std::vector<std::string>& doubts = diagnosis->doubts;
  if (!fit.converged) {
    doubts.push_back("the fit did not converge: " + fit.termination);
  }
  for (const ParameterEstimate& p : fit.parameters) {
    if (p.at_bound) doubts.push_back(p.name + " ended at its bound");
  }
  // Another model, or motion unlike that of the fit.
  constexpr double kForeign = 5.0;
  const double train = std::max(1.0, diagnosis->base.train_error());
  if (diagnosis->base.holdout_error() > kForeign * train) {
    doubts.push_back(
        "the held-out runs are predicted much worse than the fitted ones: are "
        "they of the same machine?");
  }
  for (const std::vector<std::string>& group : fit.not_identifiable) {
    doubts.push_back(group.size() == 1
                         ? "the data does not determine " + group[0]
                         : "the data cannot tell apart " + Join(group));
  }
}

// A fit that does not converge is tried in shorter segments, which ask less of
// a wrong model.
void Search::Shorten(Diagnosis* diagnosis) const {
  const auto failed = [](const Judgement& judgement) {
    return !judgement.fit.converged ||
           !std::isfinite(judgement.train_error()) ||
           !std::isfinite(judgement.holdout_error());
  };
  if (!failed(diagnosis->base)) return;
  DiagnosisProblem shorter = problem_;
  const double before = diagnosis->base.fit.segment_s;
  shorter.options.segment = std::max(0.1, before / 4.0);
  Judgement again = JudgeBase(shorter);
  if (failed(again)) {
    // No step was taken where the start is hopeless.
    diagnosis->usable = diagnosis->base.fit.iterations > 0 &&
                        std::isfinite(diagnosis->base.train_error()) &&
                        std::isfinite(diagnosis->base.holdout_error());
    return;
  }
  char text[160];
  std::snprintf(text, sizeof(text),
                "the fit did not converge in segments of %.3g s; this is of "
                "segments of %.3g s",
                before, again.fit.segment_s);
  diagnosis->doubts.push_back(text);
  diagnosis->base = std::move(again);
}

// The model in segments four times as long, where the motion is regular over
// that time; nothing where it is not, or where a segment is a whole run
// already.
std::optional<Judgement> Search::Lengthen(const Judgement& now) const {
  constexpr double kGrowth = 4.0;
  constexpr double kRegular = 0.6;  // of the longest that is chosen
  const double length = now.fit.segment_s;
  const double longest = now.problem->LongestDuration();
  if (problem_.options.segment > 0 || !now.fit.converged ||
      length < kRegular * kLongestLength || length > 0.9 * longest) {
    return std::nullopt;
  }
  Report("longer segments", 0, 0, now.train_error());
  Judgement longer =
      JudgeLonger(problem_, now, std::min(kGrowth * length, longest));
  // A wrong minimum, or chaos: the errors of longer predictions grow, but not
  // without measure.
  if (!longer.fit.converged || !std::isfinite(longer.train_error()) ||
      !std::isfinite(longer.holdout_error()) ||
      longer.train_error() > kGrowth * now.train_error() ||
      longer.fit.segment_s < 1.1 * length) {
    return std::nullopt;
  }
  return longer;
}

Diagnosis Search::Run() {
  Diagnosis diagnosis(problem_.model);
  diagnosis.base = JudgeBase(problem_);
  Shorten(&diagnosis);
  Doubt(&diagnosis);
  if (!diagnosis.usable) {
    diagnosis.verdict = diagnosis.final_verdict = Verdict::kUnexplained;
    diagnosis.where.channels = diagnosis.base.fit.train.channels;
    diagnosis.where.segments = diagnosis.base.fit.train.segments;
    return diagnosis;
  }
  Judgement* now = &diagnosis.base;
  std::optional<Judgement> longer;  // the base in longer segments
  for (int step = 0; step < kMostSteps;) {
    const Screening screening = Screen(*now);
    std::vector<Trial> trials = Propose(screening);
    Confirm(*now, &trials);
    int best = Choose(trials);
    if (best < 0) {
      std::vector<Trial> pairs = ProposePairs(screening);
      Confirm(*now, &pairs);
      const int pair = Choose(pairs);
      if (pair >= 0) {
        best = static_cast<int>(trials.size());
        trials.push_back(std::move(pairs[pair]));
      }
    }
    if (best >= 0) {
      AddRivals(screening, *now, best, &trials);
      best = Choose(trials);
    }
    const Trial* found = best >= 0 ? &trials[best] : nullptr;
    if (diagnosis.candidates.empty() ||
        (found != nullptr && diagnosis.steps.empty())) {
      diagnosis.candidates.clear();
      diagnosis.tests = screening.tests;
      List(screening, &trials, best, &diagnosis);
      diagnosis.verdict = Decide(*now, found);
    }
    diagnosis.final_verdict = Decide(*now, found);
    if (found == nullptr) {
      // What is too small for a segment adds up over a longer one.
      std::optional<Judgement> next = Lengthen(*now);
      if (!next) break;
      std::optional<Judgement>& place =
          diagnosis.steps.empty() ? longer : diagnosis.final;
      place = std::move(next);
      now = &*place;
      continue;
    }
    if (!options_.add) break;
    Trial& chosen = trials[best];
    DiagnosisStep added;
    std::vector<const Effect*> effects;
    for (const int e : chosen.effects) {
      added.effects.push_back(screening.effects[e].name());
      effects.push_back(screening.effects[e].effect.get());
    }
    added.segment_s = now->fit.segment_s;
    added.predicted = chosen.predicted;
    added.train_before = now->train_error();
    added.holdout_before = now->holdout_error();
    added.train_after = chosen.after->train_error();
    added.holdout_after = chosen.after->holdout_error();
    added.parameters = EstimatesOf(*chosen.after, effects);
    diagnosis.steps.push_back(added);
    diagnosis.final = std::move(*chosen.after);
    now = &*diagnosis.final;
    if (!now->fit.converged) *now = Rejudge(problem_, std::move(*now));
    // What was exchanged changes what the newest is good for.
    if (LookBack(added.effects, now, &diagnosis.steps)) {
      LookBack({}, now, &diagnosis.steps);
    }
    if (++step == kMostSteps) diagnosis.final_verdict = Decide(*now, nullptr);
  }
  // What the first step could not see the later ones did.
  if (!diagnosis.steps.empty() &&
      diagnosis.final_verdict == Verdict::kAdequate) {
    diagnosis.verdict = Verdict::kMissingEffect;
  }
  Report("where it fails", 0, 0, diagnosis.base.train_error());
  diagnosis.where = FindWhere(diagnosis.base);
  return diagnosis;
}

}  // namespace

std::string ToString(Verdict verdict) {
  switch (verdict) {
    case Verdict::kAdequate:
      return "adequate";
    case Verdict::kMissingEffect:
      return "missing_effect";
    case Verdict::kUnexplained:
      return "unexplained";
  }
  return "";
}

std::vector<std::string> Diagnosis::added() const {
  std::vector<std::string> names;
  for (const auto& effect : last().added) names.push_back(effect->name());
  return names;
}

Diagnosis Diagnose(const DiagnosisProblem& problem,
                   const std::vector<std::shared_ptr<const Effect>>& candidates,
                   const DiagnosisOptions& options) {
  return Search(problem, candidates, options).Run();
}

}  // namespace sysid
