#pragma once

#include <string>

namespace sysid {

// The text of a file. Throws InputError (place: the path) where it is missing,
// a folder, cannot be read, is binary (holds a NUL byte) or larger than half of
// the memory. Pipes are fine.
std::string ReadTextFile(const std::string& path);

}  // namespace sysid
