#pragma once

#include <vector>

#include "sysid/diagnosis/candidate_list.h"
#include "sysid/unexplained_force/unexplained_force.h"

namespace sysid {

// What there is to draw beside the unexplained force of a evaluated, at its
// curves' times and along the fitted motion: position, velocity and effort of
// each curve's joint, and for the first `count` candidates the force that each
// would add with the parameters that it is expected to have. Everything stays
// empty where the dynamics fail at the fit.
void AddForcesToCompare(const EvaluatedModel& evaluated, int count,
                        std::vector<ForceCurve>* curves,
                        std::vector<CandidateEffect>* candidates);

}  // namespace sysid
