#pragma once

#include <vector>

#include "residuals/parameter_forces.h"
#include "sysid/diagnosis/linearized_fit.h"

namespace sysid {

// What generalised forces beside the model's do to the errors of a fit: its
// segments linearised sample by sample, (7.1).
class ForceResponse {
 public:
  // The fit must outlive it. By all threads; Valid() is false where the
  // dynamics fail.
  explicit ForceResponse(const LinearizedFit& fit);
  bool Valid() const { return valid_; }

  const LinearizedFit& fit() const { return fit_; }
  const SegmentTangent& tangent(int segment) const {
    return tangents_[segment];
  }
  // The whitened errors of a segment under forces: rows x columns.
  Eigen::MatrixXd Respond(int segment, const ParameterForces& forces) const;

 private:
  const LinearizedFit& fit_;
  std::vector<SegmentTangent> tangents_;
  bool valid_ = false;
};

}  // namespace sysid
