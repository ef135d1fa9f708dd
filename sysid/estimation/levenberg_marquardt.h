#pragma once

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// Pieces of the estimation that more than one estimator needs.

// Fewest samples of a segment: they must say more than its state is free to do.
int MinSegmentSamples(const ShootingProblem& problem);

// A point cut into segments of about `length` seconds, with states from
// `sample_states` (samples x state_size for each run).
ShootingPoint CutPoint(const ShootingProblem& problem,
                       const Eigen::VectorXd& theta,
                       const std::vector<RowMatrixXd>& sample_states,
                       double length);

// The states alone, theta as the model has it (the problem frees nothing):
// short segments first, then `length`, joined by `defect`.
ShootingPoint StatesOnly(const ShootingProblem& problem, double length,
                         double defect);

// The longest step, of the median sample period over 1, 2, 4, ..., with which
// rolling the point's segments out differs from half that step by less than
// kStepError standard deviations (rms of the worst segment).
inline constexpr double kStepError = 0.2;
double ChooseStep(const ShootingProblem& problem, const ShootingPoint& point);

}  // namespace sysid
