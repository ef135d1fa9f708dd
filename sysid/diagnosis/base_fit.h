#pragma once

#include "sysid/diagnosis/diagnose.h"

namespace sysid {

// Whether the fit of the model as it was given is one to search from.

// Tries a fit that does not converge in shorter segments, which ask less of a
// wrong model; says so in `doubts`, or that no fit is `usable`.
void ShortenSegments(const DiagnosisProblem& problem, Diagnosis* diagnosis);

// Why the base is not to be trusted.
void AddDoubts(Diagnosis* diagnosis);

}  // namespace sysid
