#pragma once

#include <functional>
#include <limits>
#include <map>
#include <vector>

#include "sysid/inverse_dynamics/equation_columns.h"
#include "sysid/inverse_dynamics/equation_products.h"

namespace sysid {

// What every driven joint has: viscous and Coulomb friction, armature, a bias.
bool IsPlainLaw(const Effect& effect);

// The search among sets of candidates by the equations of motion
// (equation_look.h): least squares of columns whose products, by joint and
// stretch of time, are made once, so that nothing depends on how long the
// recording is.
class EquationSearch {
 public:
  // Columns beside those of EquationColumns, which come after them: the ten
  // coordinates (11.1) of links, with what is believed of them, (11.18).
  struct Bodies {
    int columns = 0;
    Eigen::MatrixXd belief;  // columns x columns
  };
  // The least squares of some columns.
  struct Trial {
    std::vector<int> at;  // columns
    Eigen::VectorXd d;
    Eigen::VectorXd variance;  // by joint, of what is left
    double likelihood = -std::numeric_limits<double>::infinity();  // (11.14)
    double cost_of_bodies = 0.0;                                   // 1/2 d' P d
    // Of each stretch of time, by the least squares of the others: the changes,
    // stretch x column, and what they leave, stretch x joint.
    Eigen::MatrixXd without, squares;
  };

  // `rows` of runs have the columns of both; `theta` are the values of
  // EquationColumns::parameters where they were made, `gains` EffortGains.
  // Equations of `silent` joints tell nothing. All must outlive it.
  EquationSearch(const EquationColumns& columns,
                 const std::vector<FreeParameter>& free,
                 const Eigen::VectorXd& theta, const std::vector<int>& gains,
                 const std::vector<EquationRows>& rows, Bodies bodies,
                 const std::vector<int>& silent,
                 std::function<void()> throw_if_cancelled);

  // Finds the effects, with the bodies as given, or as the data and what is
  // believed of them say.
  void Run(bool bodies_are_free);

  const Trial& now() const { return now_; }
  const std::vector<int>& chosen() const { return chosen_; }  // candidates
  // Of a change, in the order of now().at, by the jackknife over stretches.
  double Deviation(Eigen::Index at) const { return Deviation(now_, at); }
  // Whether a column is zero.
  bool IsZero(int column) const { return ActsOnAlone(column, {}); }
  int special_laws() const;  // of those, others than plain ones
  double p_value(int candidate) const { return p_value_.at(candidate); }
  // The changes of theta, in the order of now().at.
  Eigen::VectorXd Changes() const { return Changes(now_); }
  // Whether another search's model predicts stretches of time better by more
  // than a standard error, and by what matters of a joint.
  bool IsBeatenBy(EquationSearch* other) {
    return Advantage(&other->now_, &now_) > 1.0 && Matters(other->now_, now_);
  }

 private:
  Trial Solve(std::vector<int> at, Eigen::VectorXd variance) const;
  std::vector<int> With(const std::vector<int>& chosen) const;
  Eigen::VectorXd Changes(const Trial& trial) const;
  bool ActsOnAlone(int column, const std::vector<int>& joints) const;
  // The candidates of `chosen` whose values no such law has.
  std::vector<int> Impossible(const Trial& trial,
                              const std::vector<int>& chosen) const;
  bool IsPossible(const Trial& trial, const std::vector<int>& chosen) const {
    return Impossible(trial, chosen).empty();
  }
  // The trial of these, without plain laws that are no longer possible.
  Trial SolvePossible(std::vector<int>* chosen) const;
  void LeaveStretchesOut(Trial* trial) const;  // `without`, `squares`
  // How much more likely a is, in standard errors of the difference.
  double Advantage(Trial* a, Trial* b) const;
  // Whether a leaves less of some joint than b by what matters.
  static bool Matters(const Trial& a, const Trial& b);
  // Whether the bodies need what one model has and another lacks: without it
  // they leave what was believed of them.
  bool Unbends(const Trial& with, const Trial& without) const;
  double IndependentBodyColumns() const;

  // Adds the laws that every driven joint has, and takes out those of them that
  // are missed by less than two standard errors.
  void SettlePlainLaws();
  double Deviation(const Trial& trial, Eigen::Index at) const;
  // What candidates would add to the likelihood with the variances as they are,
  // by candidate.
  std::vector<double> FirstOrderGains() const;
  bool AddOne();
  bool TakeOutOne();
  // Takes a plain law of a joint in the place of another that predicts no
  // better by more than a standard error.
  bool ExchangeOne();
  bool IsChosen(int candidate) const;
  bool IsPlain(int candidate) const;

  const EquationColumns& columns_;
  const Eigen::VectorXd& theta_;
  const std::vector<int>& gains_;
  const std::function<void()> throw_if_cancelled_;
  Bodies bodies_;
  bool bodies_are_free_ = false;
  Eigen::MatrixXd P_;    // of all columns
  ChangeBounds bounds_;  // of the free parameters; none of effects
  std::vector<EquationProducts> stretches_;
  EquationProducts all_;
  std::vector<int> chosen_;
  std::map<int, double> p_value_;  // of the chosen, when they came
  Trial now_;
};

}  // namespace sysid
