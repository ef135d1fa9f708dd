#pragma once

#include <algorithm>
#include <cctype>
#include <string>

namespace sysid {

// A text as the name of a test, which has letters and digits alone.
inline std::string TestName(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return !std::isalnum(c); }, '_');
  return text;
}

}  // namespace sysid
