#pragma once

#include <vector>

#include "sysid/diagnosis/candidate_columns.h"
#include "sysid/diagnosis/columns_by_forces.h"

namespace sysid {

// The set of each candidate that gains most (GainOf): of those with a grid by
// forces held between samples, of those that saturate exactly. `variance` is
// that of the numbers that remain.
std::vector<CandidateSet> ChooseSets(const LinearizedFit& fit,
                                     const Model& fitted,
                                     const ColumnsByForces& by_forces,
                                     const std::vector<Candidate>& candidates,
                                     double variance);

}  // namespace sysid
