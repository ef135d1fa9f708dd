#pragma once

#include <vector>

#include "residuals/segment.h"

namespace sysid {

// A segment's rollout linearised about itself, sample by sample:
//
//   dx_{k+1} = A_k dx_k + B_k df_k,   dr_k = C_k dx_k                   (7.1)
//
// df_k a generalised force (nv numbers, N m or N) that acts from sample k to
// k + 1 beside the model's. Whatever changes in the model enters as such a
// force, so that one linearisation serves any number of candidates.
struct SegmentTangent {
  RowMatrixXd states;          // samples + 1 x state_size, from first to last
  RowMatrixXd middle;          // samples x state_size, halfway to the next
  RowMatrixXd acceleration;    // samples x nv, there
  std::vector<RowMatrixXd> A;  // tangent_size x tangent_size
  std::vector<RowMatrixXd> B;  // tangent_size x nv
  RowMatrixXd C;      // rows x tangent_size, each by the state at its sample
  Eigen::VectorXd r;  // errors, SI
};

// False where the dynamics fail. By rollout.linearization(), over x_k and f_k.
bool LinearizeAlong(const SegmentRollout& rollout, const double* x0,
                    const double* theta, SegmentTangent* tangent);

}  // namespace sysid
