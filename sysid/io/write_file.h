#pragma once

#include <string>

namespace sysid {

// Writes a file whole or not at all: to one beside it without a name, which
// gets its name once it has reached the disk (linkat). Where there is a file of
// that name already, or the file system knows no files without names, the name
// is at first a temporary one, PATH.sysid-part-PID-N, then it is renamed. A
// device or pipe is written directly, a symbolic link followed. Throws
// InputError with the path and the system's reason, and leaves nothing behind.
//
// A program that is killed (SIGKILL, a power cut) between the two calls leaves
// the temporary name. Nobody reads such a file, and the checks below remove
// those of their folder whose writers are gone: a writer holds a lock (flock)
// on its file, which the kernel drops with the process.
void WriteFileAtomically(const std::string& path, const std::string& text);

// Before long work: makes the folder, with its parents, and proves that files
// can be written there. Throws InputError.
void CheckWritableFolder(const std::string& folder,
                         const std::string& flag = "");

// Before long work: proves that the file could be written (its folder must be
// there). Leaves a file that is there as it is. Throws InputError.
void CheckWritableFile(const std::string& path);

}  // namespace sysid
