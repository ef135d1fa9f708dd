#pragma once

#include <vector>

#include "sysid/hypotheses/coarse_fit.h"
#include "sysid/linearization/linearized_fit.h"

namespace sysid {

// A continuous hypothesis p in the linear least squares of a fit (7.3): with
// the residuals r, states and parameters projected out of all, and the secant
// c = Q [r(p + h) - r(p)] / h by recordings that are changed and rolled out
// again,
//
//   p^ = -c'r / c'c,   |r|^2 falls by (c'r)^2 / c'c,
//   var p^ = sum_w (c_w'(r_w + c_w p^))^2 / (c'c)^2,                   (10.1)
//
// the variance by clusters, the windows w: errors within one are correlated.
struct Secant {
  double value = 0.0;
  double std_error = 0.0;
  double ratio = 1.0;  // of the error that is left
};

class Secants {
 public:
  // Of a coarse fit, which must outlive it.
  Secants(const CoarseFitter& fitter, const CoarseFit& fit);
  bool Valid() const { return linearized_.Valid(); }
  const LinearizedFit& linearized() const { return linearized_; }

  // Q times the change of the residuals of every segment where the training
  // windows are without what is supposed. Empty where they cannot be rolled
  // out.
  using Columns = std::vector<Eigen::MatrixXd>;
  Columns Change(const Supposition& supposed) const;
  // The same where only windows of this run are.
  Columns OfRun(const Columns& columns, int run) const;

  Secant Test(const Columns& change, double step) const;
  // |Q r + change| over |Q r|: with states and parameters fitted anew.
  double Ratio(const Columns& change) const;

  double work() const { return work_; }  // of one Change

 private:
  const CoarseFitter& fitter_;
  const CoarseFit& fit_;
  LinearizedFit linearized_;
  double work_ = 0.0;
};

}  // namespace sysid
