#include "sysid/session/run_list.h"

#include <glob.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "models/error.h"
#include "sysid/io/csv.h"

namespace sysid {
namespace {

namespace fs = std::filesystem;

// The file, or those that the pattern meets, at the end of `files`.
void AddFiles(const std::string& entry, const std::string& place,
              std::vector<std::string>* files) {
  std::error_code error;
  if (!IsFilePattern(entry) || fs::exists(entry, error)) {
    files->push_back(entry);
    return;
  }
  const std::vector<std::string> met = GlobFiles(entry);
  if (met.empty()) {
    const std::string from = place.starts_with("--") ? "the current folder"
                                                     : "the folder of the list";
    throw InputError(
        place, "no file matches '" + entry + "'",
        "patterns are * ? [..] as in a shell; relative ones begin in " + from);
  }
  files->insert(files->end(), met.begin(), met.end());
}

// A line without its comment and the spaces around.
std::string WithoutComment(const std::string& line) {
  for (size_t at = line.find('#'); at != std::string::npos;
       at = line.find('#', at + 1)) {
    if (at == 0 || line[at - 1] == ' ' || line[at - 1] == '\t') {
      return std::string(Trim(std::string_view(line).substr(0, at)));
    }
  }
  return std::string(Trim(line));
}

void AddListed(const std::string& list, const std::string& flag,
               std::vector<std::string>* files) {
  std::error_code error;
  std::ifstream in(list);
  if (list.empty() || !in || fs::is_directory(list, error)) {
    const std::string why =
        list.empty()                    ? "names no file"
        : fs::is_directory(list, error) ? "is a folder"
        : !fs::exists(list, error)
            ? "is not there"
            : std::string("cannot be read: ") + std::strerror(errno);
    throw InputError(flag, "the list '@" + list + "' " + why,
                     "@FILE is a text file that names a recording in each "
                     "line");
  }
  const fs::path folder = fs::path(list).parent_path();
  const size_t before = files->size();
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    const std::string place = list + ":" + std::to_string(++number);
    if (number == 1 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
    if (line.ends_with('\r')) line.pop_back();
    if (line.find('\0') != std::string::npos) {
      throw InputError(place, "is not text",
                       "is it a recording? Name recordings without the @");
    }
    const std::string entry = WithoutComment(line);
    if (entry.empty()) continue;
    if (entry[0] == '@') {
      throw InputError(place, "'" + entry + "' is a list within a list",
                       "name its recordings here, or both lists on the flag");
    }
    AddFiles((folder / entry).lexically_normal().string(), place, files);
  }
  if (files->size() > before) return;
  throw InputError(flag, "the list '@" + list + "' names no recording",
                   "write a file's name in each line");
}

}  // namespace

bool IsFilePattern(const std::string& text) {
  return text.find_first_of("*?[") != std::string::npos;
}

std::vector<std::string> GlobFiles(const std::string& pattern) {
  glob_t found{};
  std::vector<std::string> files;
  if (glob(pattern.c_str(), GLOB_NOSORT, nullptr, &found) == 0) {
    files.assign(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  }
  globfree(&found);
  std::sort(files.begin(), files.end());  // by bytes, whatever the locale
  return files;
}

std::vector<std::string> ExpandRuns(const std::vector<std::string>& entries,
                                    const std::string& flag) {
  std::vector<std::string> files;
  for (const std::string& entry : entries) {
    if (entry[0] == '@') {
      AddListed(entry.substr(1), flag, &files);
    } else {
      AddFiles(entry, flag, &files);
    }
  }
  return files;
}

}  // namespace sysid
