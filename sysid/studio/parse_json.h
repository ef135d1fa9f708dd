#pragma once

#include <optional>
#include <string>

#include "sysid/report/json.h"

namespace sysid {

// More than any JSON of ours has.
constexpr int kMostJsonDepth = 100;

// A text from a file or a request; none where it is no JSON, or nested deeper
// than kMostJsonDepth: to copy, compare or write that recurses until the stack
// ends.
std::optional<Json> ParseJson(const std::string& text);

}  // namespace sysid
