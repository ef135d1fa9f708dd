#pragma once

#include <vector>

#include "sysid/diagnosis/candidate_columns.h"
#include "sysid/diagnosis/columns_by_forces.h"

namespace sysid {

// The sets of each candidate that may gain most (GainOf), best first: by forces
// held between samples, which do not tell apart what gains alike; all of those
// of which forces say nothing (by_forces.Says). `variance` is that of the
// numbers that remain.
std::vector<std::vector<int>> ChooseSets(
    const LinearizedFit& fit, const ColumnsByForces& by_forces,
    const std::vector<Candidate>& candidates, double variance);

}  // namespace sysid
