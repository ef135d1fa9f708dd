#include "sysid/io/cell.h"

#include <cctype>
#include <charconv>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>

#include "models/error.h"

namespace sysid {

std::string Format(const char* format, ...) {
  char text[512];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof(text), format, arguments);
  va_end(arguments);
  return text;
}

bool ParseNumber(std::string_view text, double* value) {
  text = Trim(text);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-' && text[1] != '+') {
    text.remove_prefix(1);
  }
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, *value);
  if (rest != end || text.empty()) return false;
  if (error == std::errc()) return true;
  if (error != std::errc::result_out_of_range) return false;
  // Too large or too small for a double: 1e999 is infinite, 1e-999 is 0.
  *value = std::strtod(std::string(text).c_str(), nullptr);
  return true;
}

bool ParseDecimalComma(std::string_view text, double* value) {
  const size_t comma = text.find(',');
  if (comma == std::string_view::npos || comma + 1 >= text.size() ||
      !std::isdigit(static_cast<unsigned char>(text[comma + 1]))) {
    return false;
  }
  std::string point(text);
  point[comma] = '.';
  // A second comma or a point beside it is no number.
  return text.find('.') == std::string_view::npos && ParseNumber(point, value);
}

std::string ShortestText(double value) {
  char buffer[32];
  const auto result = std::to_chars(buffer, buffer + sizeof(buffer), value);
  return std::string(buffer, result.ptr);
}

std::string RoundedText(double value) { return Format("%.9g", value); }

std::string CsvCell(const std::string& text) {
  const bool plain = text.find_first_of(",\"\r\n") == std::string::npos &&
                     Trim(text).size() == text.size();
  if (plain) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + "\"";
}

std::string ShellQuoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    quoted += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return quoted + "'";
}

std::string JoinSome(std::vector<std::string> names) {
  constexpr size_t kMost = 24;
  if (names.size() > kMost) {
    const size_t more = names.size() - kMost;
    names.resize(kMost);
    names.push_back("and " + std::to_string(more) + " more");
  }
  return Join(names);
}

std::string CountOf(size_t n, const std::string& noun) {
  return std::to_string(n) + " " + noun + (n == 1 ? "" : "s");
}

}  // namespace sysid
