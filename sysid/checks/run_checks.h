#pragma once

#include <vector>

#include "models/error.h"
#include "sysid/checks/check.h"

namespace sysid {

// Every check on the input, worst finding first. Takes milliseconds for the
// numbers; the physics take about the time of one short fit where that comes to
// the noise, and of some tens where it does not.
std::vector<Finding> RunChecks(const CheckInput& input);

// What the reader refused, as a finding.
Finding Unreadable(const std::string& file, const InputError& error);

}  // namespace sysid
