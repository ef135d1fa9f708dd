#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sysid/io/column_map.h"
#include "sysid/io/table_file.h"

namespace sysid {

// A run in several files: "velocity.csv/x" in a map's expressions is the column
// x of the file velocity.csv beside the run's own (or at that path). Its rows
// and those of the others are one table by time: a row at each time of any of
// them, where what another file says at another time is missing, so that no
// sample is invented. Times that differ by less than a millionth of a second
// are one.
//
// The time of each file is what the map gives for "t", by the same expression,
// or without one its column "t".
//
// `file` as it is where the map names no other. Throws InputError where another
// cannot be read, or has no time.
std::unique_ptr<TableFile> JoinOtherFiles(std::unique_ptr<TableFile> file,
                                          const ColumnMap& map);

}  // namespace sysid
