#pragma once

#include <vector>

#include "ceres/ceres.h"
#include "sysid/estimation/shooting_segment.h"

namespace sysid {

// The states of segments that are tightly joined, as a minimiser moves them.
//
// A step of Gauss and Newton (dx_k, dtheta) from x leaves of the defects what
// the linear model says, but for the second order of the motion:
//
//   d_k(x [+] dx, theta + dtheta) = d_k + D_k dx_k + E_k dtheta
//                                   - F_k dx_k+1 + O(|dx|^2).           (6.13)
//
// Divided by a tight sigma_d that second order costs more than the step gains,
// so that it is refused, and one that is short enough gains next to nothing
// (Maratos 1978). So the states are moved a second time, one after the other,
// to where the defects are what the linear model says:
//
//   x'_0 = x_0 [+] dx_0,
//   x'_k+1 = f(x'_k, theta + dtheta) [+] -(d_k + D_k dx_k + E_k dtheta
//                                          - F_k dx_k+1)                (6.14)
//
// (as Mastalli et al. 2020 do in the multiple shooting of optimal control). It
// is the same step to first order, and costs a rollout. A chaotic motion lets
// the change grow from segment to segment: each run keeps what costs less.
//
// Ceres' states are then only coordinates of these: those of
// ShootingSegmentCost are asked here.
class JoinedStates final : public ceres::EvaluationCallback {
 public:
  // `point` is where the minimiser writes. Segments are joined by defects of
  // these standard deviations. A second order that costs less than `least` is
  // left. `columns`: of the derivatives that the minimiser will want.
  JoinedStates(const Model& model, Solution* point, ShootingSegments* segments,
               const std::vector<double>& defect_sigma,
               ShootingSegment::Columns columns, int threads);

  void PrepareForEvaluation(bool with_J, bool is_new) override;
  const double* State(int run, int segment) const {
    return now_[run].data() + segment * now_[run].cols();
  }
  // Makes the minimiser's states these.
  void Adopt();
  void set_least(double least) { least_ = least; }

 private:
  // Where the minimiser took a step last: its numbers, and these.
  struct Base {
    std::vector<RowMatrixXd> asked, states;
    Eigen::VectorXd theta;
    // By run and segment; the defect, and its derivatives by the tangents of
    // x_k, theta and x_k+1.
    std::vector<std::vector<Eigen::VectorXd>> defect;
    std::vector<std::vector<RowMatrixXd>> J, J_next;
  };
  bool IsAt(const std::vector<RowMatrixXd>& states,
            const Eigen::VectorXd& theta) const;
  void Move(int run);
  void SetBase(int run);
  // Half the squares of the errors and the whitened defects of a run from
  // these states; infinity where the dynamics fail. `of_defects`: of those
  // alone.
  double Cost(int run, const RowMatrixXd& states, double* of_defects);

  const Model& model_;
  Solution* const point_;
  ShootingSegments* const segments_;
  const Whitening defect_;
  const ShootingSegment::Columns columns_;
  const int threads_;
  double least_ = 0.0;
  bool has_base_ = false;
  Base base_;
  std::vector<RowMatrixXd> asked_, now_;  // what `now_` is for
  Eigen::VectorXd theta_;
};

}  // namespace sysid
