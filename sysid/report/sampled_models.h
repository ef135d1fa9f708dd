#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sysid/session/session.h"
#include "sysid/stochastic/solvers.h"

namespace sysid {

// Models of which each is a draw from what a fit found, as URDF, for domain
// randomisation, and the draws as a table: from the mixture of gmm, else from
// the normal distribution of the estimate (DrawFromEstimate).
struct SampledModels {
  std::vector<std::string> urdfs;
  std::string csv;  // a row a draw, a column a parameter
  // In sentences: what does not vary, and why.
  std::vector<std::string> remarks;
  std::string failure;  // why there are none, else empty
};

// Throws InputError at --sample where there is nothing to draw, or no memory
// for so many: before the fit.
void CheckSampling(const Session& session, int count);

SampledModels SampleModels(const Session& session,
                           const ShootingProblem& problem, const Solved& solved,
                           int count, std::uint64_t seed);

}  // namespace sysid
