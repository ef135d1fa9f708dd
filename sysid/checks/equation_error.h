#pragma once

#include <vector>

#include "sysid/checks/quick_fit.h"

namespace sysid {

// How far the efforts of a recording are from those that its motion needs: the
// error of the equations of motion, where that of a prediction says little, of
// a motion that the model cannot follow.
//
// q, qd and qdd of each joint are those of a quintic fitted to the samples
// around, weighed by a Gaussian; u are the efforts that act, ID is the inverse
// dynamics, and g a wider Gaussian, which takes away what is faster than the
// motion (cogging, friction that sticks, the noise of qdd):
//
//   r(t; theta) = g * [u(theta) - ID(q, qd, qdd; theta)].               (C.2)
//
// r is linear in masses, first moments and inertias and in the coefficients of
// friction, so one step leaves the least, r + J dtheta; of each joint by its
// own size, found by iteration (Khalil and Dombre, "Modeling, Identification
// and Control of Robots", 2002, chapter 12).
class EquationError {
 public:
  // Standard deviations of the Gaussians, s.
  struct Widths {
    double motion = 0.0;   // of the fit's weights
    double average = 0.0;  // of g
  };

  // Of windows of one recording or several, whose joints are all simple and
  // measured. Each contributes its times without `margin`, s, at either end;
  // where a channel has no samples around there is no row.
  EquationError(const LooseModel& model, const std::vector<Run>& windows,
                double margin, const Widths& widths);

  // Windows count by blocks of neighbours, so that one can be left out.
  static constexpr int kBlocks = 8;

  // The geometric mean over the joints of the root mean square of what is left,
  // N m and N; without a block, or with all (-1). Infinite where there are too
  // few rows.
  double Least(int without = -1) const;

 private:
  // Of a block and a joint: [J | r], turned to a triangle.
  struct Part {
    int block = 0, joint = 0;
    int rows = 0;  // that were turned
    Eigen::MatrixXd triangle;
  };
  std::vector<Part> parts_;
  int joints_ = 0, columns_ = 0;
};

}  // namespace sysid
