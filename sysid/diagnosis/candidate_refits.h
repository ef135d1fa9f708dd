#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sysid/diagnosis/evaluated_model.h"

namespace sysid {

// What the screening proposes is tried: refitted from the fitted point, and
// judged by cross-validation (docs/theory.md section 7).

using Candidates = std::vector<std::shared_ptr<const Effect>>;

// The iterations that a refit has left are worth their time where they lower
// the error by this part of it.
inline constexpr double kMaterial = 0.01;
// Of the screening's criterion: twice a log-likelihood.
inline constexpr double kClearly = 10.0;
// A refit may stand in the place of a model whose error is less by this factor.
inline constexpr double kNear = 1.5;

// Of a refit that is to be judged, not kept: it ends after some iterations, or
// where those left would not gain what is worth a refit. `error` is about the
// one that it comes to.
EstimationOptions TrialOptions(const EstimationOptions& options, double error);

// The refit of one proposal: one effect or two.
struct CandidateRefit {
  std::vector<int> effects;  // in the screening
  // Those effects as they are expected: by the screening, or by a better one.
  std::vector<ScreenedEffect> expected;
  double predicted = 0.0;
  std::optional<EvaluatedModel> after;
  std::string refused;  // empty: accepted

  bool accepted() const { return after && refused.empty(); }
};

// The best by the screening; of those that explain the same, two.
std::vector<CandidateRefit> ProposeEffects(const Screening& screening);
// Two that together explain what neither does alone. Of `singles`, which were
// refitted, one that has not kept what the screening promised of it keeps no
// more of it in a pair.
std::vector<CandidateRefit> ProposePairs(
    const Screening& screening, const std::vector<CandidateRefit>& singles);

// Whether all parameters of an effect are also the other's, which has more.
bool IsPartOf(const Effect& part, const Effect& whole);

// Whether neither of two models predicts better by more than one standard error
// of the difference.
bool AreAsGood(const EvaluatedModel& a, const EvaluatedModel& b);

// Whether the errors may be noise alone, on both kinds of runs.
bool IsAtNoiseFloor(const EvaluatedModel& evaluated);

// Of the effects that were added the one that a random force of the size that
// is still missing most likely makes up, by (6.7) of the fit of all runs, one
// trajectory each (nothing where that cannot follow the motion: then of the fit
// in segments); empty where none does at 95 %, all candidates paid for.
std::string LikeliestChance(const DiagnosisProblem& problem,
                            const EvaluatedModel& evaluated,
                            const std::optional<Fit>& whole, size_t candidates);

// Why some effect that was added is not what it means; empty where all are.
std::string WhyImplausible(const EvaluatedModel& evaluated);

// Why a refit of one of `tried` proposals is not accepted; empty where it is.
std::string WhyRefused(const DiagnosisProblem& problem,
                       const EvaluatedModel& before,
                       const CandidateRefit& refit, int tried);

// Refits proposals, and chooses among them. What it is made from must outlive
// it.
class Refitter {
 public:
  Refitter(const DiagnosisProblem& problem, const Candidates& candidates)
      : problem_(problem), candidates_(candidates) {}

  // Refits, in parallel, and says which are refused.
  void Confirm(const EvaluatedModel& before,
               std::vector<CandidateRefit>* refits) const;
  // Adds and refits effects of which a part was refitted and came near to the
  // best, but is not the best: a part that is chosen has its turn later.
  void AddWholes(const Screening& screening, const EvaluatedModel& before,
                 int best, std::vector<CandidateRefit>* refits) const;
  // Adds and refits what else could stand in the place of the best effect.
  void AddRivals(const Screening& screening, const EvaluatedModel& before,
                 int best, std::vector<CandidateRefit>* refits) const;
  // The best of the accepted, -1 where none is.
  int Choose(const std::vector<CandidateRefit>& refits) const;
  bool IsBetter(const EvaluatedModel& a, const EvaluatedModel& b) const;

 private:
  // The candidates as seen from the trajectories that a refit led to, which are
  // much nearer to the truth than those of the model before, with its own
  // effect back at null to first order. Empty where that is not possible.
  Screening SeenFrom(const CandidateRefit& refit) const;
  int Rarity(const EvaluatedModel& evaluated) const;

  const DiagnosisProblem& problem_;
  const Candidates& candidates_;
};

}  // namespace sysid
