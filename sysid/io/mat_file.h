#pragma once

#include <memory>
#include <string>

#include "sysid/io/byte_source.h"
#include "sysid/io/table_file.h"

namespace sysid {

// The numbers in a MATLAB file (versions 5, 7 and 7.3), by their MATLAB names:
// "t" for a vector, "pos(:,2)" for a column of a matrix that is longer than it
// is wide, "pos(2,:)" for a row of one that is wider, "log.q" and "out.y(3).v"
// for what structures and their arrays hold. Dimensions of length 1 do not
// count. What is no real number (text, cells, complex or sparse matrices,
// objects such as timeseries and tables) is left out, with a notice.
//
// Columns may differ in length, as long as those that are read together do not.
// Throws InputError where the file is cut off or damaged, where a matrix claims
// more numbers than the file can hold, and where this build lacks the library
// matio.
std::unique_ptr<TableFile> OpenMatFile(ByteSource source, const std::string&);

}  // namespace sysid
