#pragma once

#include "residuals/segment.h"

namespace sysid {

// What the same data say of theta alone, without a rollout (the equations of
// motion, (11.4)): residuals divided by their standard deviations. Never
// changes.
class ThetaEquations {
 public:
  virtual ~ThetaEquations() = default;
  virtual int rows() const = 0;
  // `r` has rows() numbers; `J`, rows x theta, where it is not null.
  virtual void Evaluate(const double* theta, double* r,
                        RowMatrixXd* J) const = 0;
};

}  // namespace sysid
