#pragma once

#include <limits>
#include <vector>

#include "models/error.h"
#include "sysid/checks/check.h"

namespace sysid {

struct CheckResult {
  std::vector<Finding> findings;  // worst first
  // By what a quick fit of the model misses the data, without what is wrong
  // with their numbers: in times the noise. NaN where nobody could ask.
  double error = std::numeric_limits<double>::quiet_NaN();
};

// Every check on the input. Takes milliseconds for the numbers; the physics
// take about the time of one short fit where that comes to the noise, and of
// some tens where it does not.
CheckResult RunChecks(const CheckInput& input);

// What the reader refused, as a finding.
Finding Unreadable(const std::string& file, const InputError& error);

}  // namespace sysid
