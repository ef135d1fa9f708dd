#pragma once

#include <vector>

#include "sysid/stochastic/rollouts.h"

namespace sysid {

// The sums in (9.1) over rollouts, at several theta at once, and what they
// depend on them by:
//
//   S(theta) = sum_k sum_channels rho(|r_k|^2)
//   dS/dtheta = 2 sum_k sum_channels rho'(|r_k|^2) J_k^T r_k             (9.7)
//
// r weighted, J = dr/dtheta by SegmentRollout::LinearizeByTheta: structured
// where the model's effects allow. Rollouts of all theta are spread over
// threads; each has a place of its own, and the places are added in order: the
// numbers do not depend on how many threads there are.
//
// Keeps its memory from one evaluation to the next, for one caller at a time.
// The rollouts' problem must outlive it.
class RolloutSums {
 public:
  // Of the rollouts `which`, at each row of `thetas`.
  void Evaluate(const Rollouts& rollouts, const std::vector<int>& which,
                double huber, int threads, const RowMatrixXd& thetas);

  // Of the last evaluation, row by row. A value is infinite where the dynamics
  // of a rollout fail; its gradient then says nothing.
  const Eigen::VectorXd& values() const { return values_; }
  const RowMatrixXd& gradients() const { return gradients_; }

 private:
  // Of one thread.
  struct Scratch {
    SegmentScratch segment;
    Eigen::VectorXd errors, pull;
    std::vector<double> end;
    RowMatrixXd J, J_end;
  };

  // One rollout at one theta: S, then dS/dtheta. False where it fails.
  static bool Sum(const Rollouts& rollouts, int i,
                  const SegmentRollout& rollout, double huber,
                  const double* theta, Scratch* scratch, double* sum);

  std::vector<SegmentRollout> rollouts_;
  std::vector<Scratch> scratch_;
  RowMatrixXd parts_;  // a row for each theta and rollout
  Eigen::VectorXd values_;
  RowMatrixXd gradients_;
};

}  // namespace sysid
