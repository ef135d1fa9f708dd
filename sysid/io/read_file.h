#pragma once

#include <string>

namespace sysid {

// The text of a file. Throws InputError (place: the path) where it is missing,
// a folder, cannot be read, or is binary (holds a NUL byte). Pipes are fine.
std::string ReadTextFile(const std::string& path);

}  // namespace sysid
