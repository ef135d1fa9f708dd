#pragma once

#include <limits>
#include <string>
#include <vector>

#include "models/error.h"
#include "sysid/checks/check.h"

namespace sysid {

// An explanation of what the model misses, compared with the others in windows
// that were not fitted.
struct ComparedExplanation {
  std::string what;          // "spring@joint1", "joint1.q read 8 ms earlier"
  bool of_data = false;      // a fault of the data; else of the model
  double error = 0.0;        // that it leaves, in times the noise
  double error_ratio = 1.0;  // to that of the model as given, (10.3)
};

struct CheckResult {
  std::vector<Finding> findings;  // worst first
  // By what a coarse fit of the model misses windows that were not fitted, in
  // times the noise. NaN where nobody asked or could.
  double error = std::numeric_limits<double>::quiet_NaN();
  std::vector<ComparedExplanation> compared;  // least error first
  // Faults whose hypotheses were not asked for want of time, by name.
  std::vector<std::string> not_asked;
};

// Every check of the numbers alone, milliseconds each; worst first.
std::vector<Finding> CheckNumbers(const CheckInput& input);

// What the reader refused, as a finding.
Finding Unreadable(const std::string& file, const InputError& error);

}  // namespace sysid
