#pragma once

#include <string>
#include <vector>

#include "residuals/run.h"
#include "sysid/io/column_map.h"

namespace sysid {

// Throws InputError for a recording that is given twice: it would count as
// twice the evidence, and one that is fitted is none to judge by.
void CheckDistinct(const std::vector<std::string>& traj,
                   const std::vector<std::string>& holdout);

// Throws InputError for runs whose times allow no fit: too few samples; samples
// more than a second apart (milliseconds? a factor for t in the map switches
// this off); pauses that no prediction crosses.
void CheckTimes(const std::vector<Run>& runs, const ColumnMap& columns);

// Throws InputError where no channel of any run ever changes.
void CheckMotion(const std::vector<Run>& runs);

}  // namespace sysid
