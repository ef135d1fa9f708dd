#pragma once

#include <vector>

#include "sysid/hypotheses/explanation.h"

namespace sysid {

// Which faults of the data promise most, best first: by secants at the fit that
// misses least, by the equations of motion, or by short fits (docs/checks.md).
std::vector<Suspect> FirstLooks(Competition* competition);

}  // namespace sysid
