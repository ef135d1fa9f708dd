#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sysid/diagnosis/fitted_sets.h"
#include "sysid/diagnosis/set_search.h"

namespace sysid {

// A set that is to be fitted, from where, and what is expected of it.
struct ProposedSet {
  std::vector<int> effects;  // in the catalogue, ascending
  int parameters = 0;
  std::set<std::string> without_influence;
  // Values by name: the whole joint step, less of it, and none, since its first
  // order may overshoot.
  std::vector<std::map<std::string, double>> starts;
  std::shared_ptr<FittedSet> from;  // where it was predicted
  double error = 0.0;               // predicted, without the trust of (J.3)
};

// Looks at what is missing: linearisations at fitted models, what they predict
// of other sets, and which of those are worth a fit (sections 3 to 5 of
// docs/judgement.md).
class Looks {
 public:
  // All must outlive it.
  Looks(const DiagnosisProblem& problem, const Candidates& catalogue,
        const FittedSets& fitted);

  void From(const std::shared_ptr<FittedSet>& at);
  // From this set, as good as it is now.
  bool WasMadeFrom(const FittedSet& at) const;
  void Clear();
  // For longer segments: what was refuted stays so, as they are less linear.
  void GoOn();

  // The set to fit next, to replace the best one; and what came of it, which
  // may say that the predictions of others are wrong, too.
  std::optional<ProposedSet> Next(const FittedSet& best) const;
  void Learn(const ProposedSet& proposed, const FittedSet& fitted);

  // Notes what the looks from which the best set was proposed call as good: at
  // its own fit the linearisation does not know what its going would do.
  void NoteAlike(const FittedSet& best);
  // Those, the fewest parameters first.
  std::vector<ProposedSet> AlikeTo(const FittedSet& best) const;
  // Whether a set with one other effect is the same force as the best in this
  // data, by the last look from that; false where there was none.
  bool IsSameForce(const FittedSet& best,
                   const std::vector<int>& effects) const;
  // Predicted sets that are, the most common laws first.
  std::vector<ProposedSet> SameForceAs(const FittedSet& best) const;

 private:
  // What a refit from a look's set added, and by how much less it did than was
  // predicted: ln of the ratio of the errors. Or an effect whose law excluded
  // the values that it had.
  struct Refuted {
    std::set<int> added;
    double ratio;
    // What it took out. Over other segments only what takes out as much is
    // refuted.
    std::set<int> removed;
    bool over_others = false;

    // Whether a set, beside that of the look, makes the same changes.
    bool Has(const std::vector<int>& effects,
             const std::vector<int>& of_look) const;
  };
  struct Look {
    std::shared_ptr<FittedSet> at;
    std::unique_ptr<LinearSets> sets;
    std::vector<PredictedSet> predicted;
    std::vector<Refuted> refuted;
  };
  // A set as a look predicts it, with what was refuted there.
  struct Prediction {
    ModelScore score;
    size_t look;
    const PredictedSet* set;
    double mean() const { return score.log_errors.mean(); }
  };

  const Look* LastFrom(const std::vector<int>& effects) const;
  // Of each set that was not fitted from there, as the nearest look has it.
  std::vector<Prediction> Nearest() const;
  // A fitted set, as uncertain as the look's predictions.
  static ModelScore NowAt(const Look& look, const FittedSet& fitted);
  // Whether the best set (`now`) should give way to a prediction.
  bool IsWanted(const Prediction& one, const ModelScore& now,
                const FittedSet& best) const;
  static ProposedSet Propose(const Look& look, const LinearSets::Score& score);

  const DiagnosisProblem& problem_;
  const Candidates& catalogue_;
  const FittedSets& fitted_;
  const Commonness commonness_;
  std::vector<Look> looks_;
  // Over shorter segments, by the set from which it was.
  std::map<std::vector<int>, std::vector<Refuted>> refuted_;
  // Which sets were fitted from where.
  std::set<std::pair<std::vector<int>, const FittedSet*>> tried_;
  // By the effects of a set that was the best, those of each other one, and by
  // how much it is worse (mean of ln e).
  using Alike = std::map<std::vector<int>, std::pair<double, ProposedSet>>;
  std::map<std::vector<int>, Alike> alike_;
};

}  // namespace sysid
