#pragma once

#include <cstdint>
#include <istream>

namespace sysid {

// How many bytes a MATLAB file would have at least, by what stands in its first
// `size`, which are all there are: more where it is cut off, 0 where it does
// not say. A file that is cut between two variables does not show it.
//
// Version 5 and 7: MAT-File Format, MathWorks, chapter 1. Version 7.3: HDF5
// File Format Specification, "Superblock".
uint64_t MatFileLength(std::istream* file, uint64_t size);

}  // namespace sysid
