#pragma once

#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <vector>

#include "sysid/inverse_dynamics/equation_models.h"

namespace sysid {

// The search among sets of candidates by the equations of motion
// (equation_look.h).
class EquationSearch {
 public:
  static constexpr int kAll = std::numeric_limits<int>::max();

  EquationSearch(std::unique_ptr<const EquationModels> models,
                 std::function<void()> throw_if_cancelled);

  // Finds the effects; ends where it has more special laws.
  void Run(int most_special_laws = kAll);

  const EquationModels& models() const { return *models_; }
  const EquationModels::Fit& now() const { return now_; }
  const std::vector<int>& chosen() const { return now_.chosen; }
  int special_laws() const;  // of those, others than plain ones
  double p_value(int candidate) const { return p_value_.at(candidate); }
  EquationModels::Estimate EstimateOf(int candidate) {
    return models_->EstimateOf(&now_, candidate);
  }
  // Whether another search's model predicts stretches of time better by more
  // than a standard error, and by what matters of a joint.
  bool IsBeatenBy(EquationSearch* other) {
    return models_->Advantage(&other->now_, &now_) > 1.0 &&
           models_->Matters(&other->now_, &now_);
  }

 private:
  // Adds the laws that every driven joint has, and takes out those of them that
  // are missed by less than two standard errors.
  void SettlePlainLaws();
  // Takes all plain laws of an effect's joints (null: of all), but for those
  // that other laws have the place or the column of (the bias of a spring).
  void AskPlainLaws(const Effect* of, std::vector<int>* chosen) const;
  bool AddOne();
  bool TakeOutOne();
  // Takes a plain law of a joint, or a law with fewer columns, in the place of
  // another that predicts no better by more than a standard error, or by what
  // matters.
  bool SimplifyOne();
  // Takes another value of what is searched in a law where that is likelier, or
  // another law of the same joints where that is worth more, too: by more than
  // chance makes of the best of all where it has more columns.
  bool MoveOne();
  // Whether one predicts better than the other by more than so many standard
  // errors, and by what matters.
  bool IsWorthMore(EquationModels::Fit* one, EquationModels::Fit* other,
                   double errors = 1.0) const {
    return models_->Advantage(one, other) > errors &&
           models_->Matters(one, other);
  }
  // Takes `fit`, in which `by` has the place of `of`.
  void Replace(int of, int by, EquationModels::Fit fit);
  bool IsChosen(int candidate) const;
  // Whether a candidate and one of these cannot be together.
  bool IsExcluded(int candidate, const std::vector<int>& by) const;

  const std::unique_ptr<const EquationModels> models_;
  const std::function<void()> throw_if_cancelled_;
  std::map<int, double> p_value_;  // of the chosen, when they came
  EquationModels::Fit now_;
};

}  // namespace sysid
