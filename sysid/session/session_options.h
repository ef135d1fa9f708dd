#pragma once

#include <string>
#include <vector>

#include "sysid/session/session.h"

namespace sysid {

// How to fit, from flags and specification; flags win. All throw InputError at
// the place of what is wrong.

std::string ChooseSolver(const FitRequest& request,
                         const FitSpecification& spec);

// What does not depend on the runs.
void FillOptions(const FitRequest& request, const FitSpecification& spec,
                 EstimationOptions* options);

// The integration step and the length of segments, as they suit the runs. A
// step that is longer than the samples are apart is cut to that, and a segment
// to the longest run, with a notice.
void FillLengths(const FitRequest& request, const FitSpecification& spec,
                 const std::vector<Run>& runs, EstimationOptions* options,
                 std::vector<std::string>* notices);

}  // namespace sysid
