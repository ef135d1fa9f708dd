#pragma once

#include <vector>

#include "sysid/checks/as_read.h"

namespace sysid {

// As FindReading (find_reading.h), of the readings with a number.
bool FindKnob(AsRead* as_read, std::vector<Finding>* findings);

}  // namespace sysid
