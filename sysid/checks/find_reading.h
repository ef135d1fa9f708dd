#pragma once

#include <vector>

#include "sysid/checks/as_read.h"

namespace sysid {

// Appends the reading (shipped_checks.h) that explains what the model misses in
// the data as they were read, if one does; the criterion is that of
// docs/checks.md. Whether one was found.
bool FindReading(AsRead* as_read, std::vector<Finding>* findings);

}  // namespace sysid
