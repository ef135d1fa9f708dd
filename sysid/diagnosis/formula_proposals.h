#pragma once

#include <set>
#include <string>
#include <vector>

#include "sysid/diagnosis/effect_search.h"
#include "sysid/diagnosis/formula_proposal.h"

namespace sysid {

// The force that a model misses is regressed on products of the motion, efforts
// and inputs (formula_terms.h): each term is an effect c f with one linear
// parameter, and
//
//   argmin |r + S dx + Theta dtheta + sum_k A_k c_k|^2 over few k         (J.4)
//
// with A_k what the force f_k does to the errors, (7.3), so that each instant
// weighs by how certain the force is there, and smooth or slow forces are not
// differentiated. That is the search of section 5 over sets of such terms, the
// effects of the catalogue's best set among them: forward selection by
// cross-validated errors (J.3), refits, (J.2) with m the number of terms, and
// no answer that a random force could make up. Of its answer and rivals those
// are proposed that beat the catalogue's best set and have few terms (kDepth).
// Terms on one joint become one formula, fitted again as a user would.
//
// `found`: the catalogue's best set. Of an answer that explains most of what
// the model as given misses; else nothing.
std::vector<FormulaProposal> ProposeFormulas(
    const DiagnosisProblem& problem, const EvaluatedModel& found,
    const std::set<std::string>& joints, int candidates,
    const ReportDoing& report);

}  // namespace sysid
