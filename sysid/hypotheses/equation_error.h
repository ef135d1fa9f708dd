#pragma once

#include <vector>

#include "sysid/hypotheses/coarse_fit.h"

namespace sysid {

// How far the efforts of a recording are from those that its motion needs: the
// error of the equations of motion. No rollout: a first look at a hypothesis,
// and of motions that a model cannot follow.
//
// The rows are those of (11.2), r(t; theta) = g * [u - ID(q, qd, qdd)], with a
// g that takes away what is faster than the motion (cogging, friction that
// sticks, the noise of qdd).
//
// r is linear in masses, first moments and inertias and in the coefficients of
// friction, so one step leaves the least, r + J dtheta; of each joint by its
// own size, found by iteration (Khalil and Dombre, "Modeling, Identification
// and Control of Robots", 2002, chapter 12).

// [J | r] of a window and a joint, turned to a triangle.
struct EquationPart {
  int rows = 0;  // that were turned
  Eigen::MatrixXd triangle;
};

// Of an excerpt of recordings whose joints are all simple and measured; where a
// channel has no samples around there is no row.
class EquationWindows {
 public:
  EquationWindows(const CoarseModel& model, const Excerpt& excerpt,
                  const Excerpt::Change& change);
  // By joint.
  const std::vector<EquationPart>& window(int w) const { return windows_[w]; }
  double work() const { return work_; }

 private:
  std::vector<std::vector<EquationPart>> windows_;
  double work_ = 0.0;
};

// The geometric mean over the joints of the root mean square of what is left of
// these windows, N m and N, with one theta. Infinite where there are too few
// rows.
double LeastEquationError(
    const std::vector<const std::vector<EquationPart>*>& windows);

}  // namespace sysid
