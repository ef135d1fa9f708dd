#pragma once

#include "sysid/estimation/fit.h"

namespace sysid {

// Least squares on the equations of motion (docs/theory.md section 11): no
// rollout, no start that must be near. One linear regression for whatever the
// equations are linear in; again from where it ends while something else moves.
// Bounds, priors and possible bodies (4.1) are kept.
//
// Needs the measured position of every joint. Positions that carry noise bias
// it a little, as every regression on filtered signals: Levenberg-Marquardt
// from here is the unbiased one.
Fit FitInverseDynamics(const ShootingProblem& problem);

// The problem begun at such values, where they predict the measurements over
// short segments better than the initial ones; else, or where a joint is not
// measured, the problem as it is.
ShootingProblem StartByInverseDynamics(const ShootingProblem& problem);

}  // namespace sysid
