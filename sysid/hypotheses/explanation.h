#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sysid/checks/check.h"
#include "sysid/hypotheses/coarse_fit.h"
#include "sysid/hypotheses/data_hypothesis.h"

namespace sysid {

// One explanation of the recordings, fitted and judged: the model as it is or
// with more physics, of the data as read; or a fault of the data.
struct Explanation {
  std::string name;        // "spring@joint1"; empty: the model as it is
  bool of_bodies = false;  // masses, inertias or lengths are other ones
  int place = -1;  // of a fault: in the list of all, likelier ones first
  double std_error = 0.0;  // of its scalar
  bool augmented = false;  // a fault, and more physics too
  DataVerdict verdict = DataVerdict::kRejected;  // of a fault
  CoarseFit fit;

  const DataHypothesis& hypothesis() const { return *fit.supposed.hypothesis; }
};

// A fault that is to be fitted.
struct Suspect {
  int place = 0;
  Supposition supposed;  // its scalar is where the search for it starts
  double promise = 1.0;  // predicted error over that as read
};

// Adds the kind of a fault, as ToString names it, where it is not there.
void AddKind(const DataHypothesis& hypothesis, std::vector<std::string>* kinds);

// All that competes: fits explanations within a budget of work and keeps those
// that are no faults of the data, the rivals.
class Competition {
 public:
  Competition(const CheckInput& input, double budget, int samples);

  const CheckInput& input() const { return input_; }
  CoarseFitter& fitter() { return fitter_; }
  // With friction: a missing friction is no fault of the data.
  const CoarseModel& model() const { return model_; }
  const std::vector<DataHypothesis>& all() const { return all_; }

  bool Affords(double work) const { return fitter_.work() + work <= budget_; }
  // Of a fit of the model, which has more columns where it is `augmented`.
  double FitWork(const CoarseModel& model, int iterations) const;
  // Spends the work where the budget has it.
  bool Spend(double work);
  // Faults that the budget left no work for, as ToString names them.
  void LeaveOut(const DataHypothesis& hypothesis);
  const std::vector<std::string>& not_asked() const { return not_asked_; }

  void FitAsGiven();
  void FitAugmented();
  // The best effects of the screening.
  void FitEffects();
  // The first: the model as it is.
  const std::vector<Explanation>& rivals() const { return rivals_; }
  const Explanation& as_given() const { return rivals_.front(); }
  // The one that misses the training windows least.
  const Explanation& least() const;
  bool rough() const { return rough_; }
  // Whether the augmented model leaves nothing to be explained.
  bool explained() const { return explained_; }

  std::optional<Explanation> Fit(const Suspect& suspect, bool augmented);

  // Of the windows of these runs (empty: all).
  Difference Gain(const Explanation& a, const Explanation& b,
                  const std::vector<int>& runs) const;
  // The best rival of a fault.
  const Explanation& BestRival(const DataHypothesis& hypothesis) const;
  DataVerdict Judge(const Explanation& explanation) const;

 private:
  Explanation AsRead(const std::string& name, bool of_bodies,
                     const CoarseModel& model, int iterations);

  const CheckInput& input_;
  const double budget_;
  CoarseFitter fitter_;
  const CoarseModel model_;
  const std::vector<DataHypothesis> all_;
  std::vector<Explanation> rivals_;
  bool rough_ = false, explained_ = false;
  std::vector<std::string> not_asked_;
};

}  // namespace sysid
