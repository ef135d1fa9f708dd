#pragma once

#include <vector>

#include "residuals/segment_tangent.h"

namespace sysid {

// How a change of a model's parameters acts on a segment: as generalised forces
// between samples, and directly on what is measured.
//
// With the effort u(p) that acts and the inverse dynamics ID of the model, the
// motion satisfies ID(q, qd, qdd; p) = u(p). A change of p leaves
//   f = d [u(p) - ID(q, qd, qdd; p)] / dp                               (7.2)
// unbalanced, which acts as a force beside the model's: masses, frames,
// gravity, friction, gains and delays alike. It is taken halfway between two
// samples and held.
struct ParameterForces {
  // Per interval: nv x columns, N m or N per unit of the parameter.
  std::vector<RowMatrixXd> f;
  // Rows of the segment x columns, SI: offsets of sensors, frames that move.
  RowMatrixXd direct;

  // `columns` of zeros for a segment.
  static ParameterForces Zero(const SegmentRollout& rollout, int columns);
};

// The derivatives by the parameters of `map`, of `model`, at `theta`: a column
// each. The model is that of the rollout, with more effects, which are off at
// theta.
ParameterForces ForcesOfParameters(const Model& model, const ParameterMap& map,
                                   const Eigen::VectorXd& theta,
                                   const SegmentRollout& rollout,
                                   const SegmentTangent& tangent);

// What theta -> `to` changes, by its difference: one column, N m or N.
ParameterForces DifferenceOfForces(const Model& model, const ParameterMap& map,
                                   const Eigen::VectorXd& theta,
                                   const Eigen::VectorXd& to,
                                   const SegmentRollout& rollout,
                                   const SegmentTangent& tangent);

}  // namespace sysid
