#pragma once

#include <vector>

#include "sysid/linearization/candidate_columns.h"

namespace sysid {

// The probe sets of each candidate that get exact columns, three at most: of
// its grid the points that may gain most (GainOf), best first, by forces held
// between samples, which do not tell apart what gains alike. Where forces say
// nothing (ColumnsByForces::Says), evenly spread ones.
std::vector<CandidateSet> ChooseProbeSets(
    const LinearizedFit& fit, const Model& fitted,
    const std::vector<Candidate>& candidates);

}  // namespace sysid
