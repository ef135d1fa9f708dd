#pragma once

#include <limits>
#include <string>
#include <vector>

#include "models/error.h"
#include "sysid/checks/check.h"

namespace sysid {

struct CheckResult {
  std::vector<Finding> findings;  // worst first
  // By what a coarse fit of the model misses windows that were not fitted, in
  // times the noise. NaN where nobody asked or could.
  double error = std::numeric_limits<double>::quiet_NaN();
  // Faults whose hypotheses were not asked for want of time, by name.
  std::vector<std::string> not_asked;
};

// Every check of the numbers alone, milliseconds each; worst first.
std::vector<Finding> CheckNumbers(const CheckInput& input);

// What the reader refused, as a finding.
Finding Unreadable(const std::string& file, const InputError& error);

}  // namespace sysid
