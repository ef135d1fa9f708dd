#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "ceres/ceres.h"
#include "residuals/costs.h"
#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// As many scratches as threads linearise at a time; whoever needs one borrows
// it.
class ScratchPool {
 public:
  std::unique_ptr<SegmentScratch> Take();
  void Give(std::unique_ptr<SegmentScratch> scratch);

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<SegmentScratch>> idle_;
};

// What divides the errors of a segment of a run by their standard deviations,
// and bends them by the problem's robust loss.
Whitening MakeWhitening(const ShootingProblem& problem, int run,
                        const SegmentRollout& rollout);

// A segment of a run with its measurements whitened. It remembers the place
// (x_k, theta) where it was last rolled out and what came of it: Ceres asks for
// one place several times (in its search along a step, for the cost of the
// step, for the Jacobian where the step was taken), and a stage starts where
// the one before it ended.
//
// Of the rows J d + r it keeps only what the normal equations know of them,
//
//   R^T R = J^T J,   R^T z = J^T r,   |z|^2 + rest^2 = |r|^2,           (6.4)
//
// R square: a step of Levenberg-Marquardt is the same, and what is kept does
// not grow with the samples of the segment.
//
// For one thread at a time.
class ShootingSegment {
 public:
  // Samples `first` to `last` of a run. The problem must outlive it, and the
  // pool, which segments of one problem share. Derivatives may have a longer
  // step, `tangent_step` (0: the same): their errors turn a step of the
  // minimiser a little, and leave the values, and so the minimum, as they are.
  ShootingSegment(const ShootingProblem& problem, const RolloutOptions& rollout,
                  int run, int first, int last, ScratchPool* pool,
                  double tangent_step = 0.0);

  const SegmentRollout& rollout() const { return rollout_; }
  // Derivatives by the tangent of x_k, by theta, or by both in this order: what
  // is fixed needs none.
  enum class Columns { kState, kTheta, kBoth };
  int CountColumns(Columns columns) const;

  // Both false where the dynamics fail.
  bool Roll(const double* x, const double* theta);
  bool Linearize(const double* x, const double* theta, Columns columns);
  // Of the last place; those in the second line where it was linearised.
  double squares() const { return squares_; }  // |r|^2
  const Eigen::VectorXd& x_end() const { return x_end_; }
  const RowMatrixXd& R() const { return R_; }
  const Eigen::VectorXd& z() const { return z_; }
  const RowMatrixXd& J_end() const { return J_end_; }  // x_end's tangent
  // Of what was linearised by both, or by these: their columns.
  RowMatrixXd Take(const RowMatrixXd& J, Columns columns) const;

  // The rows themselves; they are not kept.
  bool RollRows(const double* x, const double* theta, Eigen::VectorXd* r,
                Eigen::VectorXd* x_end) const;
  bool LinearizeRows(const double* x, const double* theta, Columns columns,
                     Eigen::VectorXd* r, Eigen::VectorXd* x_end, RowMatrixXd* J,
                     RowMatrixXd* J_end) const;

 private:
  enum class Known { kNothing, kValues, kColumns };
  bool Possible(const double* theta) const;
  // The rows with the steps of the derivatives.
  bool Differentiate(const double* x, const double* theta, Columns columns,
                     Eigen::VectorXd* r, Eigen::VectorXd* x_end, RowMatrixXd* J,
                     RowMatrixXd* J_end) const;
  bool IsAt(const double* x, const double* theta) const;
  void Remember(Known what, const double* x, const double* theta);
  void Compress(const RowMatrixXd& J, const Eigen::VectorXd& r);

  SegmentRollout rollout_;
  std::optional<SegmentRollout> tangent_;  // with a step of its own
  ScratchPool* pool_;
  Whitening whitening_;
  Known known_ = Known::kNothing;
  Columns columns_ = Columns::kBoth;  // where they are known
  std::vector<double> place_;
  double squares_ = 0.0;
  Eigen::VectorXd r_;  // of the last place, where derivatives roll out anew
  Eigen::VectorXd x_end_, z_;
  RowMatrixXd R_, J_end_;
};

// All segments of a cut.
class ShootingSegments {
 public:
  // The problem must outlive it; of the point only the cut counts.
  ShootingSegments(const ShootingProblem& problem, const Solution& point,
                   double tangent_step = 0.0);
  // Whether they are those of this cut, integrated as it says.
  bool Fit(const Solution& point) const;
  ShootingSegment* at(int run, int k) const { return runs_[run][k].get(); }

 private:
  ScratchPool pool_;
  std::vector<std::vector<std::unique_ptr<ShootingSegment>>> runs_;
  std::vector<std::vector<int>> samples_;  // as in Solution::Nodes
  RolloutOptions rollout_;
};

class JoinedStates;

// Of a segment for Ceres: parameter blocks x_k, theta (none where nothing is
// free), and x_{k+1} where another segment follows; residuals z and the rest of
// (6.4), then the whitened defect where `defect_sigma` is not empty. Where no
// derivatives are asked for all of |r| is in the rest. With `joined` the states
// are those that it has for this segment of a run and the next.
class ShootingSegmentCost final : public ceres::CostFunction {
 public:
  ShootingSegmentCost(ShootingSegment* segment,
                      const std::vector<double>& defect_sigma,
                      const JoinedStates* joined = nullptr, int run = 0,
                      int place = 0);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  ShootingSegment* segment_;
  Whitening defect_;
  const JoinedStates* joined_;
  int run_, place_;
  int measured_;  // rows
};

}  // namespace sysid
