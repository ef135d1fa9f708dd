#pragma once

#include <string>

namespace sysid {

// "0.2.0 (commit abc1234)": the version and, where the programs were built in a
// repository, the commit ("abc1234-dirty": with changes that it does not have).
std::string VersionText();

}  // namespace sysid
