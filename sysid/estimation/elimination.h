#pragma once

#include <vector>

#include "sysid/estimation/shooting_stage.h"

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
// Returns [R | z], upper triangular, theta x (theta + 1): |R dtheta + z|^2 is
// the cost, but for a constant, of the best states for each dtheta.
RowMatrixXd EliminateStates(const std::vector<RunLinearization>& runs,
                            const RowMatrixXd& J_prior,
                            const Eigen::VectorXd& r_prior, int threads);

}  // namespace sysid
