#pragma once

#include <string>
#include <vector>

namespace sysid {

// The recordings that the entries of a list name (docs/interface.md section 1,
// "Lists of runs"): files as they stand; those that a pattern of glob(7) meets
// (* ? [..]), sorted; those that the lines of a file name, "@runs.txt": a line
// each, relative to that file, patterns too; blank lines and comments (from a #
// at its start or behind a space) are dropped. A file whose own name has the
// letters of a pattern is that file.
//
// Throws InputError for a list that cannot be read, names nothing, or names
// another list, and for a pattern that meets no file; at `flag`, or at the line
// of the list.
std::vector<std::string> ExpandRuns(const std::vector<std::string>& entries,
                                    const std::string& flag);

// Whether a text would be taken for a pattern.
bool IsFilePattern(const std::string& text);

// What a pattern of glob(7) meets, sorted; nothing where it meets nothing.
std::vector<std::string> GlobFiles(const std::string& pattern);

}  // namespace sysid
