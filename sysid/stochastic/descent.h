#pragma once

#include <string>
#include <vector>

#include "sysid/estimation/fit.h"
#include "sysid/stochastic/rollouts.h"
#include "sysid/stochastic/transformation.h"

namespace sysid {

// (9.9): how much further a Gauss-Newton step from v would go.
struct GaussNewtonStep {
  double gain = 0.0;     // part of the loss that it would take away
  double squares = 0.0;  // the same as a whitened sum of squares
  Eigen::VectorXd dv;    // the step; parameters that a bound holds stay
};

// What the stochastic fits share: the rollouts that they descend over, and the
// Fit at the end.
class Descent {
 public:
  // Cuts runs into rollouts of about `segment` seconds (infinity: whole runs)
  // with first states from the data (those of runs that start from rest have
  // no velocity), and chooses the step where the options do not.
  Descent(const ShootingProblem& problem, const std::string& solver,
          double segment, bool from_rest);

  // Why there is no use in starting, else "".
  const std::string& hopeless() const { return hopeless_; }
  const Rollouts& rollouts() const { return *rollouts_; }
  const Transformation& transformation() const { return transformation_; }
  Fit* fit() { return &fit_; }
  double Seconds() const;

  // Shortens the step where it is ours to choose and the parameters have moved
  // to where they need it (a damping that has become stiff). True where it
  // changed.
  bool ShortenStep(const Eigen::VectorXd& v);
  // Whether the fit is to end with what it has, after an epoch: a first step is
  // always taken. Sets the termination.
  bool Interrupted(int epoch);
  // Appends to the history and shows progress. `loss` is over `samples`.
  void Note(int epoch, int epochs, double loss, int samples,
            const Eigen::VectorXd& v);
  // Of the loss (9.1) with squares, over all rollouts.
  GaussNewtonStep RemainingStep(const Eigen::VectorXd& v) const;
  // Estimates, errors and predictions at v.
  Fit Finish(const Eigen::VectorXd& v);

 private:
  const ShootingProblem problem_;
  const bool choose_step_;
  const double start_s_, start_cpu_s_;
  Transformation transformation_;
  Solution point_;
  std::unique_ptr<Rollouts> rollouts_;
  std::string hopeless_;
  Fit fit_;
};

}  // namespace sysid
