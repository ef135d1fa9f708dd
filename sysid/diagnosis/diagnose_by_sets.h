#pragma once

#include "sysid/diagnosis/candidate_refits.h"
#include "sysid/diagnosis/diagnose.h"

namespace sysid {

// Diagnose() by EffectSearch: what its answer says of the model as given.
Diagnosis DiagnoseBySets(const DiagnosisProblem& problem,
                         const Candidates& candidates,
                         const DiagnosisOptions& options);

}  // namespace sysid
