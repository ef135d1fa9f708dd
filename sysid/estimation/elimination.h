#pragma once

#include <vector>

#include "sysid/estimation/linearization.h"

namespace sysid {

// The triangular factor of a matrix, at most as many rows of it as columns.
RowMatrixXd TriangularFactor(const RowMatrixXd& rows);

// What the data says about theta alone: the states projected out of the
// linearised least squares min |J_x dx + J_theta dtheta + r|^2 by orthogonal
// transformations, so nothing is squared.
//
// In time order, for each segment, the rows that speak of its state x_k (what
// the past says of it, its measurements, its defect to x_{k+1}) are stacked and
// triangularised with x_k's columns first:
//
//   [ past   0    past_theta  | z ]       [ R_kk  R_k,k+1  R_k,theta | . ]
//   [ J_x  J_next  J_theta    | r ]  ->   [  0    past'    past'_theta| z']
//                                         [  0     0       R_theta    | . ]
//
// The first rows are what x_k would be computed from and are dropped; the next
// carry on; the last speak of theta alone and are collected. (6.1)
// (A square-root information filter: Bierman 1977; in SLAM: Dellaert and Kaess
// 2006.)
//
// So each run reduces itself to a square root over theta,
//
//   |R dtheta + z|^2 + rest = the cost of the best states for dtheta,
//
// kept as the triangle [R z; 0 sqrt(rest)], and those of several runs merge
// exactly, in any order, by triangularising them together: what runs have to
// exchange is as large as theta, not as their samples.
class RunReduction {
 public:
  // `state_damping`: of each state's tangent, the numbers D of the rows D dx
  // that a damped step adds (Levenberg and Marquardt); empty: none.
  explicit RunReduction(const RunLinearization& run,
                        const Eigen::VectorXd& state_damping = {});

  // At most (theta + 1) x (theta + 1), upper triangular.
  const RowMatrixXd& root() const { return root_; }
  // The change of each segment's state that goes with a change of theta:
  // segments x tangent.
  RowMatrixXd SubstituteBack(const Eigen::VectorXd& dtheta) const;

 private:
  // What a state is computed from: R dx + next dx_next + theta dtheta + z = 0.
  struct StateRows {
    Eigen::MatrixXd R, next, theta;
    Eigen::VectorXd z;
  };
  RowMatrixXd root_;
  std::vector<StateRows> states_;
};

// The square root of several.
RowMatrixXd MergeRoots(const std::vector<RowMatrixXd>& roots);
// Of those of all processes, each with at least one.
RowMatrixXd MergeRoots(const Processes& all,
                       const std::vector<RowMatrixXd>& roots);

// [R | z] of all runs with theta's priors, upper triangular,
// theta x (theta + 1).
RowMatrixXd EliminateStates(const std::vector<RunLinearization>& runs,
                            const RowMatrixXd& J_prior,
                            const Eigen::VectorXd& r_prior, int threads,
                            const Processes& all = Alone());

}  // namespace sysid
