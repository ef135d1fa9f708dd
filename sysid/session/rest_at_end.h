#pragma once

#include <string>
#include <vector>

#include "residuals/run.h"

namespace sysid {

// Leaves out what a run that nothing drives says once it has come to rest for
// good, but for a second of it: any law that dissipates predicts rest without
// an error, so that it is no evidence between laws, and held out it judges
// none. At rest is what stays within four times the range of its last
// twentieth, or a 500th of its own, of where it ends. Only where that is a
// tenth of the run or more; a notice for each.
void LeaveOutRestAtEnd(std::vector<Run>* runs,
                       std::vector<std::string>* notices);

}  // namespace sysid
