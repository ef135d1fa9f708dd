#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "residuals/parameter_forces.h"
#include "sysid/linearization/linearized_fit.h"

namespace sysid {

// The knots of a run, evenly spaced; a force is linear between two.
struct ForceKnots {
  double start = 0.0, spacing = 0.0;  // s
  int count = 0;
  double Time(int knot) const { return start + knot * spacing; }
  // The last knot before a time.
  int Before(double t) const { return static_cast<int>((t - start) / spacing); }
  // Calls visit(knot, weight) for those between which a time lies.
  template <typename Visit>
  void Around(double t, const Visit& visit) const {
    for (int k = Before(t); k <= std::min(Before(t) + 1, count - 1); ++k) {
      visit(k, std::max(0.0, 1.0 - std::abs((t - start) / spacing - k)));
    }
  }
};

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
  // Of each run. As close as the samples are worth, but so that long segments
  // of many joints stay cheap.
  const std::vector<ForceKnots>& knots() const { return knots_; }
  const Run& RunOf(int segment) const {
    return fit_.problem().runs()[fit_.segments()[segment]->run]->run;
  }
  const ForceKnots& KnotsOf(int segment) const {
    return knots_[fit_.segments()[segment]->run];
  }
  // Halfway from the i-th sample of a segment to the next, where (7.2) takes
  // the forces.
  double Middle(int segment, int i) const;
  // The whitened errors of a segment under forces: rows x columns.
  Eigen::MatrixXd Respond(int segment, const ParameterForces& forces) const;

 private:
  const LinearizedFit& fit_;
  std::vector<SegmentTangent> tangents_;
  std::vector<ForceKnots> knots_;
  bool valid_ = false;
};

}  // namespace sysid
