#pragma once

#include <string>

namespace sysid {

// Writes a file whole or not at all: to a temporary beside it, which is then
// renamed. A device or pipe is written directly, a symbolic link followed.
// Throws InputError with the path and the system's reason, and leaves nothing
// behind.
void WriteFileAtomically(const std::string& path, const std::string& text);

// Before long work: makes the folder, with its parents, and proves that files
// can be written there. Throws InputError.
void CheckWritableFolder(const std::string& folder,
                         const std::string& flag = "");

// Before long work: proves that the file could be written (its folder must be
// there). Leaves a file that is there as it is. Throws InputError.
void CheckWritableFile(const std::string& path);

}  // namespace sysid
