#pragma once

#include <string>
#include <vector>

#include "models/mechanism.h"
#include "sysid/io/column_map.h"

namespace sysid {

// Hints for a file whose columns have other names or units than ours: the
// --columns flag that would most likely read it, judged by the words in the
// names. `given` is the map so far; what it has from the flag is repeated, so
// that the hint can be typed as it is.

// "--columns t=time_ms*0.001"; with columns that look like positions where
// nothing else would be measured either. Where none looks like either, the flag
// with COLUMN in its place, and the file's columns.
std::string TimeHint(const Mechanism& mechanism,
                     const std::vector<std::string>& header,
                     const ColumnMap& given);

// The names that would be read, and "--columns joint1.q=pos1,joint2.q=pos2"
// where columns look like positions; the file's columns where none does.
// `time_column` is taken.
std::string MeasuredHint(const Mechanism& mechanism,
                         const std::vector<std::string>& header,
                         int time_column, const ColumnMap& given);

// What a column's name says that it measures.
bool LooksLikePosition(const std::string& name);
bool LooksLikeVelocity(const std::string& name);
bool LooksLikeEffort(const std::string& name);

// "pos*0.0174532925".
std::string InRadians(const std::string& column);
// "--columns joint1.q=pos*0.0174532925", and how to say that it is radians.
std::string DegreesHint(const std::string& name, const std::string& column,
                        const ColumnMap& given);
// The first half of it.
std::string DegreesFlag(const std::string& name, const std::string& column,
                        const ColumnMap& given);

}  // namespace sysid
