#pragma once

#include <vector>

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// The least squares of multiple shooting, linearised at a solution: exactly, by
// the structured tangent or by Jets (SegmentRollout::Linearize). Covariance,
// identifiability, the choice of the step and the discrepancy read it; a
// diagnosis has the same columns, and further ones, by LinearizedFit.

// One whitened residual of a run linearised at a point: rows of a segment (all,
// or their triangular factor), where it is independent those of the belief
// about its state (but for a run's first), and its defect; columns by the
// tangent of its state, theta, and the tangent of the next state (no columns
// for the last segment).
struct SegmentLinearization {
  RowMatrixXd J_x, J_theta, J_next;
  Eigen::VectorXd r;
};

// A run's segments in time order, and the belief about its first state.
struct RunLinearization {
  RowMatrixXd J_prior;  // tangent x tangent, by the first state
  Eigen::VectorXd r_prior;
  std::vector<SegmentLinearization> segments;
};

struct LinearizationOptions {
  // How tightly segments hang together (state_weights.h); infinity: not.
  double defect = 0.0;
  double twist_hold = 1.0;  // of StateBelief
  // The states that are believed; null: those of the solution.
  const Solution* believed = nullptr;
  // Of a segment's rows J d + r, all (they grow with the samples), or only
  // their triangular factor by orthogonal transformations.
  bool triangular = true;
  double tangent_step = 0.0;  // ShootingSegment's
};

// By all threads. False where the dynamics fail, in any process.
bool Linearize(const ShootingProblem& problem, const Solution& solution,
               const LinearizationOptions& options,
               std::vector<RunLinearization>* runs);

// The same with the change of the residuals to another way to integrate, in
// place of the residuals: the derivatives are those of the solution's own.
// `residuals`, by run and segment, are those that change: empty, the
// solution's own; afterwards those of the other way.
using SegmentResiduals = std::vector<std::vector<Eigen::VectorXd>>;
bool LinearizeChange(const ShootingProblem& problem, const Solution& solution,
                     const LinearizationOptions& options,
                     const RolloutOptions& to, SegmentResiduals* residuals,
                     std::vector<RunLinearization>* runs);

// theta's priors as rows: J x theta, r.
void LinearizePriors(const ShootingProblem& problem,
                     const Eigen::VectorXd& theta, RowMatrixXd* J,
                     Eigen::VectorXd* r);

}  // namespace sysid
