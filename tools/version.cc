#include "tools/version.h"

#include "sysid_commit.h"  // of the build tree: cmake/WriteCommit.cmake

namespace sysid {

std::string VersionText() {
  const std::string commit = kCommit;
  return SYSID_VERSION + (commit.empty() ? "" : " (commit " + commit + ")");
}

}  // namespace sysid
