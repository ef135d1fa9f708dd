#pragma once

#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

namespace sysid {

// What a script in Python says, as JSON; null where it fails: where it needs
// modules that are not there. The interpreter is that of the variable
// SYSID_PYTHON, else Debian's.
inline nlohmann::json RunReference(const std::string& script_and_arguments) {
  const char* python = std::getenv("SYSID_PYTHON");
  const std::string command =
      (python != nullptr ? std::string(python) : "/usr/bin/python3") + " " +
      script_and_arguments;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return nullptr;
  std::string text;
  for (char part[4096]; std::fgets(part, sizeof(part), pipe) != nullptr;) {
    text += part;
  }
  if (pclose(pipe) != 0) return nullptr;
  return nlohmann::json::parse(text);
}

}  // namespace sysid
