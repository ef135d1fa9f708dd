#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sysid/diagnosis/comparison.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/diagnosis/longer_segments.h"
#include "sysid/diagnosis/set_search.h"
#include "sysid/inverse_dynamics/equation_look.h"

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
    std::vector<FollowedMotion> followed;  // LookByEquations
    // The effects of `found`, what is missed most first.
    std::vector<int> order;
    // Drives that must be there for the machine to move: nothing tested them.
    std::vector<int> assumed;
    // All that was fitted over the segments of `found`.
    std::vector<std::shared_ptr<const FittedSet>> fitted;
  };
  // What the equations of motion show: a set to begin with; or, where that is
  // more than a search adds one by one, the answer.
  enum class Equations { kBegin, kMayAnswer };
  // From the model as given; where `start` has effects, from those.
  // At most so many fits at a horizon.
  Answer Run(const std::vector<int>& start = {},
             Equations equations = Equations::kMayAnswer,
             int most_fits = kMostFits);

  // The answer by what was fitted until Run() threw Cancelled; without a fit
  // that would judge it, so that it explains nothing unless it is at the noise.
  bool HasBase() const { return base_ != nullptr; }
  Answer SoFar() const;

 private:
  using Fitted = std::shared_ptr<FittedSet>;
  // A linearisation and what it predicts.
  struct Look {
    Fitted at;
    std::unique_ptr<LinearSets> sets;
    std::vector<PredictedSet> predicted;
    // Effects that a refit from here added, and by how much less they did than
    // was predicted: ln of the ratio of the errors. Or one whose law excluded
    // the values that it had.
    std::vector<std::pair<std::set<int>, double>> refuted;
  };
  // A set that is as good as another, as it was predicted.
  struct Alike {
    int parameters;
    double mean;  // of the log errors' difference
    std::set<std::string> without_influence;
    std::vector<std::map<std::string, double>> starts;
  };
  // A set as a look predicts it, with what was refuted there.
  struct Prediction {
    ModelScore score;
    size_t look;
    const PredictedSet* set;
    double mean() const { return score.log_errors.mean(); }
  };

  Fitted Keep(std::vector<int> effects, EvaluatedModel model);
  // Of the store, the set with the fewest parameters that none beats.
  Fitted Best() const;
  // Whether a set was beaten over shorter segments by one of the store which it
  // does not leave behind now.
  bool IsBeaten(const FittedSet& fitted) const;
  // Goes on with the best set over longer segments.
  void GoOnWith(const FittedSet& best, EvaluatedModel longer);
  // How common the effects' laws are: the sum of their places in the catalogue;
  // and their names, so that of the same laws always the same one is chosen.
  using Commonness = std::pair<int, std::vector<std::string>>;
  Commonness Rank(const std::vector<int>& effects) const;
  std::vector<std::shared_ptr<const Effect>> EffectsOf(
      const std::vector<int>& effects) const;

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
  std::vector<int> IndicesOf(const std::vector<ScreenedEffect>& effects) const;
  void LookFrom(const Fitted& at);
  bool WasLookedFrom(const FittedSet& at) const;
  Answer Judged() const;
  // Of each set that was not fitted from there, as the nearest look has it.
  std::vector<Prediction> NearestPredictions() const;
  // A fitted set, as uncertain as the look's predictions.
  static ModelScore NowAt(const Look& look, const FittedSet& fitted);
  // Whether the best set (`now`) should give way to a prediction.
  bool IsWanted(const Prediction& one, const ModelScore& now,
                const FittedSet& best) const;
  std::optional<Prediction> NextProposal(const FittedSet& best) const;
  void Fit(const Prediction& proposal);
  // What the data does not determine goes, and the rest is fitted.
  void DropUndetermined(Fitted fitted);
  static std::vector<std::map<std::string, double>> StartsOf(
      const LinearSets& sets, const LinearSets::Score& score);
  Fitted FitFrom(const FittedSet& from, std::vector<int> effects,
                 const std::set<std::string>& without_influence,
                 const std::vector<std::map<std::string, double>>& starts,
                 double enough, double error);
  // Fits proposals, at the horizon of the store, until another set is the best:
  // true then. Where none is left the best is fitted to its end.
  bool Improve();
  // Until nothing is to be gained, and from whole runs. True where that makes
  // another model of it, by what matters.
  bool FitToTheEnd(const Fitted& best);
  // Improves the best set, over longer and longer segments.
  void ImproveAndLengthen();
  // Takes out what a random force as large as what is still missing may have
  // made up; true where there was any.
  bool RefuseChance();
  void RefuseMadeUp(FittedSet* fitted) const;
  // Fits the best set without each of its members.
  void LeaveOutEach();
  // Notes what the linearisations from which the best set was proposed call as
  // good: at its own fit they do not know what its going would do.
  void NoteAlike(const FittedSet& best);
  // Fits the nearest of those.
  void FitRivals(const FittedSet& best);
  std::vector<std::shared_ptr<const FittedSet>> RivalsOf(
      const FittedSet& best) const;
  void Say(const std::string& what, const FittedSet& fitted) const;

  const DiagnosisProblem& problem_;
  const Candidates& catalogue_;
  const ReportDoing report_;
  std::map<std::string, int> ranks_;
  std::map<std::vector<int>, Fitted> store_;
  std::vector<Look> looks_;
  int most_fits_ = kMostFits;
  int fits_ = 0, failures_ = 0;  // at this horizon; in a row
  // Which sets were fitted from where.
  std::set<std::pair<std::vector<int>, const FittedSet*>> tried_;
  // Of a set that was beaten over shorter segments, by which. Longer ones are
  // fewer, and say less.
  std::map<std::vector<int>, std::vector<int>> beaten_by_;
  std::vector<int> assumed_;
  // Effects that a random force may have made up: no candidates any more.
  std::set<int> chance_;
  Fitted base_;
  EquationLook by_equations_;
  bool base_is_fitted_ = true;  // not where the equations of motion begin
  bool values_by_equations_ = false;
  // By the effects of a set that was the best, those of each other one.
  std::map<std::vector<int>, std::map<std::vector<int>, Alike>> alike_;
};

}  // namespace sysid
