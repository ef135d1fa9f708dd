#pragma once

#include <string>
#include <vector>

#include "sysid/report/json.h"
#include "sysid/session/session.h"
#include "sysid/stochastic/stochastic_fit.h"

namespace sysid {

// Its kernels, a row each.
SYSID_JSON(ParameterMixture, weights, means, stds)

// What the mixture says, for the terminal: weights, means and deviations of
// the kernels, and what befell them.
std::string MixtureText(const MixtureFit& mixture);

// Models of which each is a draw from the mixture, as URDF, for domain
// randomisation, and the draws as a table.
struct SampledModels {
  std::vector<std::string> urdfs;
  std::string csv;  // a row a draw, a column a parameter
};
SampledModels SampleModels(const Session& session,
                           const ShootingProblem& problem,
                           const MixtureFit& mixture, int count,
                           std::uint64_t seed);

}  // namespace sysid
