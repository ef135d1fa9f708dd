#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sysid/diagnosis/evaluated_model.h"
#include "sysid/linearization/candidate_columns.h"

namespace sysid {

// What any set of effects would leave of the data, to first order at a fitted
// model: (J.3) of docs/judgement.md. The motion is linearised once; then a set
// costs as much as its own columns.
class LinearSets {
 public:
  // A way for an effect to be in a model.
  struct Term {
    int effect = 0;            // in the catalogue
    std::vector<int> columns;  // of X, without r and what every model has
    Eigen::VectorXd held;      // their coefficients; empty: free
    int parameters = 0;        // that a fit would find
    // Of an effect that the fitted model lacks: whose columns, of which of its
    // probe sets, at which places of the set. -1: a member of the model, or a
    // part of one.
    int candidate = -1, set = -1;
    std::vector<int> of_set;
    std::set<std::string> without_influence;  // parameters
  };
  using Set = std::vector<int>;  // terms, ascending

  struct Score {
    Set set;
    std::vector<int> effects;  // in the catalogue, ascending
    int parameters = 0;        // beside those of the model as given
    Eigen::ArrayXd squares;    // by stretch: the first part of (J.3)
    Eigen::VectorXd v;         // coefficients of X; all stretches fitted
    // Of each term, the values of its candidate; empty of members.
    std::vector<std::vector<double>> values;
  };

  // All three must outlive it. Valid() is false where the dynamics fail.
  LinearSets(const DiagnosisProblem& problem, const EvaluatedModel& fitted,
             const Candidates& catalogue);
  bool Valid() const { return valid_; }

  const std::vector<Term>& terms() const { return terms_; }
  // The members of the fitted model.
  const Set& members() const { return members_; }
  // Whether two terms cannot be in one set: they share parameters.
  bool Exclude(int a, int b) const { return excludes_[a][b]; }
  // Nothing where the data cannot tell the set's columns apart, or where its
  // values are beyond their bounds.
  std::optional<Score> ScoreOf(const Set& set) const;
  // ln e_j(F) of (J.3), by stretch; and of squares that were not predicted here
  // but are to be compared with such.
  Eigen::ArrayXd LogErrors(const Score& score) const {
    return LogErrors(score.squares);
  }
  Eigen::ArrayXd LogErrors(const Eigen::ArrayXd& squares) const {
    return 0.5 * (squares + trust_).log();
  }
  // Whether two sets do the same: neither has a column of which the other
  // leaves a hundredth, what every model has eliminated.
  bool DoTheSame(const Set& a, const Set& b) const;

  // Where a fit of the set starts: values by name of what it moves, `part` of
  // the way from the fitted model to where the score has them. What has no
  // derivative at its null value goes all the way.
  std::map<std::string, double> StartOf(const Score& score, double part) const;
  // Parameters of its effects that the data says nothing of.
  std::set<std::string> WithoutInfluence(const Score& score) const;

 private:
  // `own`: places in fit.kept() of the members' parameters.
  void AddMembers(const LinearizedFit& fit, const std::vector<int>& own);
  void AddCandidates(const std::vector<CandidateSet>& sets,
                     const Eigen::VectorXd& own_length, double variance);
  void FindExclusions();

  const DiagnosisProblem& problem_;
  const EvaluatedModel& fitted_;
  const Candidates& catalogue_;
  bool valid_ = false;
  std::vector<Candidate> candidates_;
  std::vector<Term> terms_;
  Set members_;
  std::vector<std::vector<bool>> excludes_;
  // Normal matrices of X = [r | members' parameters | candidates' columns],
  // what every model has eliminated: of all data, without each fold, and of the
  // stretches (by the elimination without their fold).
  Eigen::MatrixXd all_;
  std::vector<Eigen::MatrixXd> without_, stretch_;
  std::vector<int> fold_;  // of a stretch
  Eigen::ArrayXd dof_;     // of a stretch
  Eigen::ArrayXd trust_;   // kappa^2 e_j(S)^2
  // Of the members' parameters: to where the law is off, and to the bounds.
  Eigen::VectorXd off_, down_, up_;
  // What is free at the linearised point, by name: what every model has, as it
  // follows X (x_B = T x_R), then the members' parameters.
  struct Value {
    std::string name;
    double value;
    bool is_plain;  // theta is the value itself, not a transform of it
  };
  std::vector<Value> always_, own_;
  Eigen::MatrixXd follow_;  // T
};

}  // namespace sysid
