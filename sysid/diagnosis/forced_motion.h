#pragma once

#include <vector>

#include "sysid/diagnosis/force_knots.h"
#include "sysid/diagnosis/force_response.h"
#include "sysid/diagnosis/smooth_force.h"

namespace sysid {

// The motion of a segment with forces beside the model's, to first order: what
// the machine did, where the model alone goes elsewhere.
struct ForcedMotion {
  RowMatrixXd middle;        // intervals x state_size, as SegmentTangent's
  RowMatrixXd acceleration;  // intervals x nv
};

// Of every segment: (7.1) with the forces, the parameters that go with them,
// and the states that suit both.
std::vector<ForcedMotion> MoveWith(const ForceResponse& response,
                                   const std::vector<ForceKnots>& knots,
                                   const SmoothForce& force);

}  // namespace sysid
