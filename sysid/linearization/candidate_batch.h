#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sysid/linearization/candidate_columns.h"

namespace sysid {

// Columns of candidates that are taken together: by parameters of one model
// that has their effects in it, each off. Off, an effect does nothing, so the
// derivative by another's parameter is what it is without it.
class CandidateBatch {
 public:
  // How its columns are computed.
  enum class By { kRollouts, kForces };
  CandidateBatch(const Model& fitted, By by);

  // False where a column of a set cannot be had beside those that are there: by
  // another value of what is searched, by the same parameter, or where one of
  // them is a secant, which changes the model: it is alone, but for forces on
  // other joints.
  bool TakeIn(const Candidate& candidate, int set, int column);
  // Where the column that was taken in goes, among all.
  void Place(int column) { columns_.push_back(column); }
  // After the last: theta, at the values that the model has.
  void Close();

  const Model& model() const { return model_; }
  const ParameterMap& map() const { return *map_; }  // a parameter a column
  const Eigen::VectorXd& theta() const { return theta_; }
  const std::vector<int>& columns() const { return columns_; }
  // Of each column the hinge or slide whose force and sensors are all that its
  // parameter changes, or -1.
  const std::vector<int>& alone() const { return alone_; }
  bool IsSecant() const { return secants_.front() != 0.0; }
  // Of each column; 0: a derivative.
  Eigen::VectorXd Secants() const {
    return Eigen::Map<const Eigen::VectorXd>(secants_.data(), secants_.size());
  }
  // Whether one of its effects has a state of its own.
  bool has_state() const { return has_state_; }

 private:
  int JointOf(const Candidate& candidate, int set, int column) const;
  bool GoesWith(double secant, int joint) const;
  bool Admit(const Candidate& candidate, const std::vector<double>& at);

  const By by_;
  const bool sees_rates_;  // a sensor does
  Model model_;
  std::vector<std::string> names_;  // of the parameters
  std::vector<int> columns_, alone_;
  std::vector<double> secants_;
  // Of each effect its own parameters, as they are set.
  std::map<std::string, std::vector<double>> values_;
  std::set<std::string> taken_;  // parameters of its effects
  bool has_state_ = false;
  std::optional<ParameterMap> map_;  // points to the model
  Eigen::VectorXd theta_;
};

// The columns of sets of candidates, one after the other, in as few batches as
// can be.
std::vector<std::unique_ptr<CandidateBatch>> MakeBatches(
    const Model& fitted, const std::vector<Candidate>& candidates,
    const std::vector<CandidateSet>& sets, CandidateBatch::By by);

int CountColumns(const std::vector<Candidate>& candidates,
                 const std::vector<CandidateSet>& sets);

}  // namespace sysid
