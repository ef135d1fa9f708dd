#pragma once

#include <vector>

#include "models/state.h"

namespace sysid {

// Positions of a joint at the times t (s) and its velocities, from measurements
// of standard deviation sigma (rad or m): of the polynomial through the samples
// in about 0.1 s around each, quadratic to sixth degree. Spikes and what is NaN
// are bridged linearly; where nothing is measured q and qd stay as they are.

// Of a hinge or slide; q and qd: one column. Where `wraps`, jumps of more than
// half a turn between samples are taken for whole turns.
void SmoothScalar(const std::vector<double>& t, bool wraps, double sigma,
                  const Eigen::VectorXd& measured, Eigen::Ref<RowMatrixXd> q,
                  Eigen::Ref<RowMatrixXd> qd);

// Of a ball joint: unit quaternions x, y, z, w (4 columns), and the angular
// velocity in the child's axes (3), of the rotation vectors about each sample.
void SmoothQuaternion(const std::vector<double>& t, double sigma,
                      const RowMatrixXd& measured, Eigen::Ref<RowMatrixXd> q,
                      Eigen::Ref<RowMatrixXd> qd);

}  // namespace sysid
