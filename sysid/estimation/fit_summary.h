#pragma once

#include "sysid/estimation/fit.h"

namespace sysid {

// Fills in what a fit says of the point where it ended: the model, errors,
// parameters with their uncertainty, what the data does not determine, step and
// segments. `fitted` numbers were fitted to the runs. Linearised with the
// fit's own defect; where the dynamics fail there it has not converged.
void SummarizeFit(const ShootingProblem& problem, const Solution& point,
                  double fitted, Fit* fit);

}  // namespace sysid
