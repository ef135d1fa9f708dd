#pragma once

#include <string>
#include <vector>

#include "models/effects/effect.h"
#include "models/mechanism.h"
#include "residuals/run.h"

namespace sysid {

// Throws InputError at `place` where a law that a user typed has no value in a
// tenth of a second or more of the runs' measured motion, as -k*sqrt(q) at
// negative q: no fit could go through there. Nothing is said of a law that is
// not linear in its parameters (sqrt(q + c) has a value where c is large), nor
// of a run that does not measure all that the law reads.
void CheckHasValues(const Effect& effect, const Mechanism& mechanism,
                    const std::vector<const Run*>& runs,
                    const std::string& place);

}  // namespace sysid
