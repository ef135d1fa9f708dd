#pragma once

#include <string>
#include <vector>

#include "residuals/run.h"
#include "sysid/io/run_sources.h"

namespace sysid {

// Throws MisreadColumn where a hinge's position, velocity or command of a run
// that was read from these columns is in degrees (degrees.h), unless the user
// gave it a factor; a notice for each column that may be.
std::vector<std::string> RefuseDegrees(const RunSources& sources,
                                       const TableFile& file,
                                       const ColumnMap& map,
                                       const Mechanism& mechanism,
                                       const Run& run);

}  // namespace sysid
