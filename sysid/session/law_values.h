#pragma once

#include <string>
#include <vector>

#include "models/effects/effect.h"
#include "models/mechanism.h"
#include "residuals/run.h"

namespace sysid {

// Throws InputError at `place` where a law that a user typed has no value in a
// tenth of a second or more of the runs' measured motion, as -k*sqrt(q) at
// negative q: no fit could go through there. Each of the values that a
// screening starts its parameters from is tried, and one that has a value
// everywhere is enough. What a run does not measure of what the law reads
// says nothing.
void CheckHasValues(const Effect& effect, const Mechanism& mechanism,
                    const std::vector<const Run*>& runs,
                    const std::string& place);

}  // namespace sysid
