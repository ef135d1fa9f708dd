#pragma once

#include <string>

#include "sysid/report/json.h"
#include "sysid/stochastic/stochastic_fit.h"

namespace sysid {

// Its kernels, a row each.
SYSID_JSON(ParameterMixture, weights, means, stds)

// What the mixture says, for the terminal: weights, means and deviations of
// the kernels, and what befell them.
std::string MixtureText(const MixtureFit& mixture);

}  // namespace sysid
