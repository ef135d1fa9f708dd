#pragma once

#include <string>
#include <vector>

#include "models/model.h"
#include "residuals/run.h"
#include "residuals/segment.h"

namespace sysid {

// A model's motion, and how it depends on its start, its parameters and what
// drives it: no measurement is needed. For controllers, planners and optimisers
// that want the derivatives themselves.
//
// The drive is a Run of which times, efforts (samples x nv, N m or N, held from
// each sample to the next) and inputs count; its channels are not read. The
// time between two samples is integrated in steps of at most
// RolloutOptions::step.

// The states at the samples of a drive, samples x state_size: x = (q, qd, z),
// where StateLayout says (model.layout()), in rad, m, rad/s, m/s and the units
// of internal states. Throws InputError for a start or a drive of the wrong
// size, and where the motion does not stay finite.
RowMatrixXd RollOut(const Model& model, const Eigen::VectorXd& x0,
                    const Run& drive, const RolloutOptions& options = {});

// The same linearised about itself: from sample k to k + 1
//
//   dx_{k+1} = A_k dx_k + B_k du_k + P_k dp
//
// A and B of (7.1). dx is a change in the tangent of the state (models/state.h,
// (3.1)); for models without spherical joints that is a change of its numbers.
// du_k is a change of the efforts that act on the joints in that time, N m or
// N: behind a drive's gain and delay, where the model has them. dp is a change
// of the parameters' values, each in its unit; what scales with a length moves
// with it, unless it is one of these parameters itself.
struct LinearizedRollout {
  RowMatrixXd states;  // samples x state_size

  // Of each of the samples but the last.
  std::vector<RowMatrixXd> A;  // tangent_size x tangent_size
  std::vector<RowMatrixXd> B;  // tangent_size x nv
  std::vector<RowMatrixXd> P;  // tangent_size x parameters

  // Of each sample, from the first on: dx_k by dx_0 (tangent_size x
  // tangent_size) and by dp (tangent_size x parameters).
  std::vector<RowMatrixXd> by_start, by_parameters;

  // dx_k by du_j: A_{k-1} .. A_{j+1} B_j, tangent_size x nv; zero for k <= j.
  RowMatrixXd ByEffort(int k, int j) const;
};

// `parameters` by name, at the model's values; none may be. Throws InputError
// as RollOut does, and for a name that there is not.
LinearizedRollout LinearizeRollout(const Model& model,
                                   const std::vector<std::string>& parameters,
                                   const Eigen::VectorXd& x0, const Run& drive,
                                   const RolloutOptions& options = {});

}  // namespace sysid
