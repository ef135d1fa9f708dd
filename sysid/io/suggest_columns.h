#pragma once

#include <string>
#include <vector>

#include "models/mechanism.h"

namespace sysid {

// Hints for a file whose columns have other names than ours: the --columns flag
// that would most likely read it, from words in the names.

// "--columns t=time_ms*0.001"; the list of columns where none looks like time.
std::string SuggestTimeColumn(const std::vector<std::string>& header);

// The names that would be read, and "--columns joint1.q=pos1,joint2.q=pos2"
// where columns look like positions. `time_column` is taken.
std::string SuggestMeasuredColumns(const Mechanism& mechanism,
                                   const std::vector<std::string>& header,
                                   int time_column);

}  // namespace sysid
