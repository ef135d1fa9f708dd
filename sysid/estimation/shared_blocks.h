#pragma once

#include <map>
#include <memory>
#include <vector>

#include "ceres/ceres.h"
#include "sysid/estimation/elimination.h"
#include "sysid/estimation/processes.h"

namespace sysid {

// The least squares of a stage whose runs several processes share out: each has
// a ceres::Problem of its own runs' states and of theta, which all have alike.
// Of a cost |r(x, theta)|^2 / 2 linearised at a place,
//
//   |J_x dx + J_theta dtheta + r|^2 + |D_x dx|^2 + |D_theta dtheta|^2,
//
// every run eliminates its states (RunReduction), and what the processes
// exchange is the sum of
//
//   S = R^T R,   b = R^T z,                                           (6.12)
//
// of the square roots [R z] over theta: as many numbers as theta has, squared,
// whatever the runs. Sums are the same however the runs are shared out
// (LongSum), and so is every step.
//
// Costs are ShootingSegmentCost (x_k, theta, x_k+1), priors of a state, and
// costs of theta alone, which count once.
class SharedBlocks {
 public:
  // A place, or a step from one by tangents: theta's, and a row for each state
  // of this process.
  struct Point {
    Eigen::VectorXd theta;
    RowMatrixXd states;
  };

  // `theta` is its block in the problem; both must outlive this. `moved`, where
  // it is not null, is told of every place before a cost is asked there, which
  // then is the problem's.
  SharedBlocks(const Processes& all, int threads, double* theta,
               ceres::Problem* problem,
               ceres::EvaluationCallback* moved = nullptr);

  // Whether there is nothing to move, in any process.
  bool Empty() const { return variables_ == 0.0; }
  bool HasBounds() const { return bounded_; }
  Point Read() const;
  void Write(const Point& at) const;
  // The place after a step, theta within its bounds.
  Point Plus(const Point& at, const Point& step) const;
  double SquaredNorm(const Point& of) const;  // of all processes
  double LargestNumber(const Point& of) const;

  // False where the cost cannot be evaluated.
  bool Cost(const Point& at, double* cost) const;
  // With its derivative along a direction.
  bool CostAlong(const Point& at, const Point& direction, double* cost,
                 double* slope) const;
  // Keeps the derivatives and the gradient. `rescale`: chooses by what columns
  // are multiplied.
  bool Linearize(const Point& at, bool rescale, double* cost);
  const Point& gradient() const { return gradient_; }
  double SlopeAlong(const Point& direction) const;

  // The damped step from where it was linearised, and by how much the linear
  // model says that the cost falls. False where it cannot be computed.
  bool Solve(double* radius, Point* step, double* falls) const;

 private:
  struct Block {  // a cost that has a state
    const ceres::CostFunction* cost;
    int x = -1, next = -1;  // places of states; -1: none
    bool with_theta = false;
  };
  // Of a block, by tangents; nothing where it has none.
  struct Rows {
    RowMatrixXd J_x, J_theta, J_next;
    Eigen::VectorXd r;
  };

  void AddCost(const ceres::CostFunction* cost,
               const std::vector<double*>& parameters,
               std::map<double*, int>* places);
  void FindChains();
  void FindBounds();
  // The tangent of a state at a place, state_size x tangent.
  RowMatrixXd TangentOf(const Point& at, int state) const;
  bool Evaluate(const Block& block, const Point& at, bool with_J,
                Rows* rows) const;
  void Tell(const Point& at, bool with_J) const;
  bool EvaluateShared(const Point& at, bool with_J, Rows* rows) const;
  RunLinearization Damped(const std::vector<int>& chain,
                          const RowMatrixXd& damping) const;
  Eigen::VectorXd SolveTheta(
      const std::vector<std::unique_ptr<RunReduction>>& chains,
      const Eigen::VectorXd& damping) const;
  Eigen::VectorXd Times(const Block& block, const Rows& rows,
                        const Point& step) const;

  const Processes& all_;
  const int threads_;
  double* const theta_;
  ceres::Problem* const problem_;
  ceres::EvaluationCallback* const moved_;
  std::vector<double*> states_;
  std::vector<Block> blocks_;  // segments and priors
  std::vector<const ceres::CostFunction*> shared_;
  // States that follow each other, and are eliminated together.
  std::vector<std::vector<int>> chains_;
  std::vector<int> segment_of_, prior_of_;  // of each state; -1: none
  bool bounded_ = false;
  int state_size_ = 0, tangent_ = 0;
  RowMatrixXd theta_tangent_;  // theta x what of it is free
  Eigen::VectorXd lower_, upper_;
  double variables_ = 0.0;  // of all processes

  // Where it was linearised; columns are scaled.
  std::vector<Rows> rows_;  // of the blocks
  Rows shared_rows_;
  Point gradient_;  // of the columns as they were
  Point scale_;
  Point diagonal_;  // squared lengths of the scaled columns
};

}  // namespace sysid
