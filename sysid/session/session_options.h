#pragma once

#include "sysid/session/session.h"

namespace sysid {

// How to fit, from flags and specification; flags win. Both throw InputError at
// the place of what is wrong.

// Solver, options and checks, as far as they do not depend on the runs.
void FillOptions(const FitRequest& request, const FitSpecification& spec,
                 Session* session);

// The integration step and the length of segments, as they suit the session's
// runs. A step that is longer than the samples are apart is cut to that, and a
// segment to the longest run, with a notice.
void FillLengths(const FitRequest& request, const FitSpecification& spec,
                 Session* session);

}  // namespace sysid
