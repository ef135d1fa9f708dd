#pragma once

#include <string>

#include "sysid/session/session.h"
#include "sysid/stochastic/stochastic_fit.h"

// The flags of the stochastic solvers: how Adam and the mixture descend.

namespace sysid {

// As the flags say; what is not given is as the options have it. Throw
// InputError for values that make no sense.
AdamFitOptions AdamOptionsFromFlags();
MixtureOptions MixtureOptionsFromFlags();

// That no flag was given that the solver (one of Solvers()) does not have.
void CheckSolverFlags(const std::string& solver);

}  // namespace sysid
