#pragma once

#include <cstdarg>
#include <cstdio>
#include <string>

namespace sysid {

// Numbers within sentences, by printf's format.
__attribute__((format(printf, 1, 2))) inline std::string Words(
    const char* format, ...) {
  char text[256];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof(text), format, arguments);
  va_end(arguments);
  return text;
}

}  // namespace sysid
