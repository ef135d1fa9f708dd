#pragma once

#include <set>
#include <string>
#include <vector>

#include "models/mechanism.h"
#include "residuals/run.h"
#include "sysid/io/column_map.h"
#include "sysid/parameters/fit_specification.h"

namespace sysid {

// Of our columns those that some file has, by its names and the map; nothing
// where one cannot be read (its reader says so).
std::set<std::string> NamesInFiles(const Mechanism& mechanism,
                                   const std::vector<std::string>& files,
                                   const ColumnMap& columns);
// Those that some run has.
std::set<std::string> NamesInRuns(const Mechanism& mechanism,
                                  const std::vector<Run>& runs);

// Locks for the joints of a whole robot's URDF that its recordings do not show:
// of those of which `shown` has no column,
//
//  - the ones whose motion no shown joint feels or makes: neither on the way
//    from it to the root nor beyond it (wheels, another arm), and
//  - where efforts are recorded, those that have a motor by the URDF (an effort
//    limit), which holds them.
//
// Others swing as they like, and are estimated. Each is held at zero, or where
// the limits are nearest to it. None where frames' positions are measured, or
// no joint is shown. `locks` is what is held already. One notice for all.
std::vector<NamedValue> LocksOfUnshown(const Mechanism& mechanism,
                                       const std::set<std::string>& shown,
                                       const std::vector<NamedValue>& locks,
                                       std::vector<std::string>* notices);

}  // namespace sysid
