#pragma once

#include <limits>
#include <vector>

#include "sysid/inverse_dynamics/equation_columns.h"
#include "sysid/inverse_dynamics/equation_products.h"

namespace sysid {

// What every driven joint may have: viscous and Coulomb friction, armature, a
// bias.
bool IsPlainLaw(const Effect& effect);

// The equations of motion (equation_look.h) of sets of candidates: least
// squares of columns whose products, by joint and stretch of time, are made
// once, so that nothing depends on how long the recording is.
class EquationModels {
 public:
  // Columns beside those of EquationColumns, which come after them: the ten
  // coordinates (11.1) of links, with what is believed of them, (11.18).
  struct Bodies {
    int columns = 0;
    Eigen::MatrixXd belief;  // columns x columns
  };
  // The least squares of a set.
  struct Fit {
    std::vector<int> chosen;  // candidates
    std::vector<int> at;      // columns: free ones, the chosen's, bodies'
    int free = 0;             // so many of the first
    Eigen::VectorXd d;
    Eigen::VectorXd variance;  // by joint, of what is left
    // What columns are scaled by where the effort has a gain, (11.17).
    JointScales scales;
    double likelihood = -std::numeric_limits<double>::infinity();  // (11.14)
    double cost_of_bodies = 0.0;                                   // 1/2 d' P d
    double posterior() const { return likelihood - cost_of_bodies; }  // its log
    // Of each stretch of time, by the least squares of the others: the changes,
    // stretch x column, and what they leave, stretch x joint.
    Eigen::MatrixXd without, squares;
  };

  // `rows` of runs have the columns of both; `gains` are EffortGains. Equations
  // of `silent` joints tell nothing. `columns`, `gains` and what is in `free`
  // must outlive it.
  EquationModels(const EquationColumns& columns,
                 const std::vector<FreeParameter>& free,
                 const std::vector<int>& gains,
                 const std::vector<EquationRows>& rows, Bodies bodies,
                 const std::vector<int>& silent, bool bodies_are_free);

  int size() const { return static_cast<int>(columns_.candidates.size()); }
  const Effect& effect(int candidate) const {
    return *columns_.candidates[candidate].effect;
  }
  int columns_of(int candidate) const {
    return columns_.candidates[candidate].count;
  }
  bool bodies_are_free() const { return bodies_are_free_; }
  double most_times() const { return all_.times.maxCoeff(); }
  bool IsPlain(int candidate) const;
  // Whether no model can have both.
  bool Exclude(int a, int b) const {
    return EquationColumns::Exclude(columns_.candidates[a],
                                    columns_.candidates[b]);
  }

  // Of no candidate, with the variances of what the given model leaves.
  Fit Given() const;
  // From these variances by joint, and from trusted ones.
  Fit Solve(const std::vector<int>& chosen,
            const Eigen::VectorXd& variance) const;
  // The same without plain laws that are not possible.
  Fit SolvePossible(std::vector<int> chosen,
                    const Eigen::VectorXd& variance) const;
  // The chosen whose values no such law has.
  std::vector<int> Impossible(const Fit& fit) const;
  bool IsPossible(const Fit& fit) const { return Impossible(fit).empty(); }

  void LeaveStretchesOut(Fit* fit) const;  // `without`, `squares`
  // t of (11.20): by how many standard errors a predicts stretches that were
  // not fitted better than b.
  double Advantage(Fit* a, Fit* b) const;
  // What chance makes of the largest t of `compared` models: of as many normal
  // deviates, and of Student's distribution for the few stretches.
  double Significant(int compared) const;
  // Whether a leaves less of some joint than b by what matters.
  bool Matters(Fit* a, Fit* b) const;
  // Whether the bodies need what one model has and another lacks: without it
  // they leave what was believed of them.
  bool Unbends(const Fit& with, const Fit& without) const;

  // What a candidate would add to the likelihood beside a set, with variances
  // and scales as they are, and the directions of its columns that the data
  // tells of.
  struct Promise {
    double gain = 0.0;
    int dof = 0;
  };
  std::vector<Promise> Promises(const std::vector<int>& beside, const Fit& now,
                                const std::vector<int>& candidates) const;

  // The changes by column, in the order of Fit::at.
  Eigen::VectorXd Changes(const Fit& fit) const;
  // Of a chosen candidate, as EquationColumns::Values, with standard errors by
  // the jackknife over stretches.
  struct Estimate {
    std::vector<double> values, std_errors;
  };
  Estimate EstimateOf(Fit* fit, int candidate) const;
  // |d| of a chosen candidate of one column over its standard error.
  double SizeOf(Fit* fit, int candidate) const;
  // Whether a column is zero.
  bool IsZero(int column) const;

 private:
  std::vector<int> With(const std::vector<int>& chosen) const;
  Fit SolveFrom(const std::vector<int>& chosen, Eigen::VectorXd variance) const;
  Eigen::Index FirstOf(const Fit& fit, int candidate) const;  // in Fit::at
  void Rescale(Fit* fit) const;                               // by its gains
  double IndependentBodyColumns(const Fit& fit) const;

  const EquationColumns& columns_;
  const std::vector<int>& gains_;
  const Bodies bodies_;
  const bool bodies_are_free_;
  Eigen::MatrixXd P_;    // of all columns
  ChangeBounds bounds_;  // of the free parameters and of linear candidates
  std::vector<EquationProducts> stretches_;
  EquationProducts all_;
  Eigen::VectorXd given_, trusted_;  // variances, by joint
};

}  // namespace sysid
