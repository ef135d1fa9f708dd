#pragma once

#include "sysid/estimation/fit.h"

namespace sysid {

// The base parameters of a fit that has a covariance of its own: which
// combinations of the coordinates (11.1) show is the equations' of motion to
// say (BaseParameters), their values are those of the fit, and their standard
// errors its covariance's.
//
// Fills Fit::base; leaves it empty where it is stopped and may keep what there
// is (EstimationOptions::keep_best), where no body is free, where a joint's
// position or all efforts were not measured, where effects have internal
// states, and where parameters cannot move the coordinates one by one.
void AddBaseParameters(const ShootingProblem& problem, Fit* fit);

}  // namespace sysid
