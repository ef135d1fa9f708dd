#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sysid/diagnosis/fitted_sets.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/diagnosis/longer_segments.h"
#include "sysid/diagnosis/looks.h"
#include "sysid/inverse_dynamics/equation_look.h"

namespace sysid {

// The search for the set of effects that is missing: docs/judgement.md, section
// 5. What is fitted is kept; the answer is the best of it, whatever the way.
class EffectSearch {
 public:
  // Both must outlive it.
  EffectSearch(const DiagnosisProblem& problem, const Candidates& catalogue,
               ReportDoing report);

  struct Answer {
    std::shared_ptr<const FittedSet> base;   // as given, over its own segments
    std::shared_ptr<const FittedSet> found;  // the base itself: nothing missing
    // Of as many parameters at most, and as good.
    std::vector<std::shared_ptr<const FittedSet>> rivals;
    bool explains = false;  // most of what the base misses
    bool at_noise = false;
    bool usable = true;  // the base could be fitted at all
    // The values of `found` are those of the equations of motion.
    bool by_equations = false;
    EquationLook look;  // what they show
    // The effects of `found`, what is missed most first.
    std::vector<int> order;
    // Drives that must be there for the machine to move: nothing tested them.
    std::vector<int> assumed;
    // Sets that are the same force as `found` in this data: its laws under
    // other names. Rivals or not.
    std::set<std::vector<int>> same_force;
    // All that was fitted over the segments of `found`.
    std::vector<std::shared_ptr<const FittedSet>> fitted;
  };
  // What the equations of motion show: a set to begin with; or, where that is
  // more than a search adds one by one, the answer.
  enum class Equations { kBegin, kMayAnswer };
  // What the equations of motion show, where that is known before Run().
  void UseLook(const EquationLook& look) { known_look_ = look; }

  // From the model as given; where `start` has effects, from those.
  // At most so many fits at a horizon.
  Answer Run(const std::vector<int>& start = {},
             Equations equations = Equations::kMayAnswer,
             int most_fits = kMostFits);

  // The answer by what was fitted until Run() threw Cancelled; without a fit
  // that would judge it, so that it explains nothing unless it is at the noise.
  bool HasBase() const { return base_ != nullptr; }
  Answer SoFar() const;
  // Whether what was found accounts for what the model as given misses.
  static bool Explains(const DiagnosisProblem& problem, const Answer& answer);

 private:
  // What the equations of motion show, where that is more than a search adds
  // one by one, which would judge each while the others are missing; no fit
  // would follow the motion of a model that misses so much. False where
  // segments judge fewer better than differentiated positions do: they are kept
  // for FitFirstSets().
  bool BeginByEquations(Equations equations);
  // The model as given, over segments that it follows.
  EvaluatedModel FitGiven() const;
  // Sets that are known before anything was linearised: drives that nobody
  // recorded, and the few effects that the equations of motion show.
  void FitFirstSets();
  // The same over segments half as long; nothing where there are none.
  std::optional<EvaluatedModel> GivenOverHalf(const EvaluatedModel& now) const;
  // Where nothing improves the model as given: the motion may be too far from
  // linear in what it misses. Over shorter segments, until something does or
  // nothing is missing.
  void LookOverShorter();
  // Improves the best set, over longer and longer segments.
  void ImproveAndLengthen();
  // Fits what the looks propose, at one horizon, until another set is the best:
  // true then. Where nothing is left to propose the best is fitted to its end.
  bool Improve();
  // Until nothing is to be gained, and from whole runs. True where that makes
  // another model of it, by what matters.
  bool FitToTheEnd(const std::shared_ptr<FittedSet>& best);
  // Goes on with the best set over longer segments.
  void GoOnWith(const FittedSet& best, EvaluatedModel longer);
  // Fits the best set without each of its members.
  void LeaveOutEach();
  // Takes out what a random force as large as what is still missing may have
  // made up; true where there was any.
  bool RefuseChance();
  // Fits the nearest of the sets that were as good as the best.
  void FitRivals(const FittedSet& best);
  // Fits the laws that are the same force as the best set's: the most common
  // ones are the answer, the others its other names.
  void FitOtherNames();
  Answer Judged() const;

  void LookFrom(const std::shared_ptr<FittedSet>& at);
  void Fit(const ProposedSet& proposed);
  // Fitted over the segments of `from`, from each of its starts until one
  // leaves no more than `enough` squares; with steps for about this error.
  EvaluatedModel Evaluate(const FittedSet& from, const ProposedSet& set,
                          double enough, double error) const;
  std::shared_ptr<FittedSet> FitFrom(const FittedSet& from,
                                     const ProposedSet& set, double enough,
                                     double error);
  std::shared_ptr<FittedSet> FitWithout(const FittedSet& from, int effect);
  // What the data does not determine goes, and the rest is fitted, where that
  // may be the best.
  void DropUndetermined(std::shared_ptr<FittedSet> fitted);
  bool MayBeBest(const FittedSet& fitted) const;
  std::vector<int> IndicesOf(const std::vector<ScreenedEffect>& effects) const;
  std::vector<std::shared_ptr<const Effect>> EffectsOf(
      const std::vector<int>& effects) const;
  void Say(const std::string& what, const FittedSet& fitted) const;

  const DiagnosisProblem& problem_;
  const Candidates& catalogue_;
  const ReportDoing report_;
  FittedSets sets_;
  Looks looks_;
  int most_fits_ = kMostFits;
  int fits_ = 0, failures_ = 0;  // at this horizon; in a row
  std::vector<int> assumed_;
  std::shared_ptr<FittedSet> base_;
  std::optional<EquationLook> known_look_;
  EquationLook by_equations_;
  std::shared_ptr<FittedSet> found_by_equations_;  // null: it is no arm
};

}  // namespace sysid
