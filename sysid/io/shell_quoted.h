#pragma once

#include <string>

namespace sysid {

// A word in single quotes, as a shell reads it back.
inline std::string ShellQuoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    quoted += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return quoted + "'";
}

}  // namespace sysid
