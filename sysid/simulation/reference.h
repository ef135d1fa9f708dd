#pragma once

#include <optional>
#include <string>
#include <vector>

#include "models/model.h"
#include "residuals/run.h"

namespace sysid {

// Where joints are to be over time: a table of positions, between whose samples
// cubics go through both positions with the slope of the parabola through the
// three samples around each end (one slope where a cubic meets the next:
// position and velocity are continuous). Before the first sample and behind the
// last the joint is at rest there.
class JointReference {
 public:
  // Of the channels J.q of a run; its first sample is time 0. Throws InputError
  // at the run's name where there is none of them, or where one leaves its
  // joint's position limits.
  JointReference(const Model& model, const Run& run);

  double duration() const { return duration_; }
  // Bodies (Model::bodies()) that have one.
  const std::vector<int>& bodies() const { return bodies_; }
  bool Has(int body) const;

  struct Point {
    double q = 0.0, qd = 0.0;
  };
  Point At(int body, double t) const;

  // Names of joints of one degree of freedom without one.
  std::vector<std::string> Missing(const Model& model) const;

  // x0 with the position and velocity that these joints have at time 0.
  Eigen::VectorXd Start(const Model& model, Eigen::VectorXd x0) const;
  // Gives those without one the position in x0, at rest.
  void HoldOthers(const Model& model, const Eigen::VectorXd& x0);

 private:
  struct Series {
    std::vector<double> t, q, qd;
  };
  std::vector<int> bodies_;
  std::vector<std::optional<Series>> series_;  // by body
  double duration_ = 0.0;
};

}  // namespace sysid
