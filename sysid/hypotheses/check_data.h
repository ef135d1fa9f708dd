#pragma once

#include <vector>

#include "sysid/checks/check.h"

namespace sysid {

// Whether one of them is of the same fault in the same place.
bool IsIn(const std::vector<Finding>& findings, const Finding& finding);

// What is wrong with recordings and model: what the numbers alone showed, and
// what hypotheses about the data explain of what the model misses. `budget` as
// in TestHypotheses.
CheckResult CheckData(const CheckInput& input, std::vector<Finding> numbers,
                      double budget);

}  // namespace sysid
