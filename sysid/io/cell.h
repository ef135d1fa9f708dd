#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "models/printable.h"

namespace sysid {

// Numbers and words within sentences, by printf's format; 511 letters at most.
__attribute__((format(printf, 1, 2))) std::string Format(const char* format,
                                                         ...);

// The whole text as a number: true and the value, else false. "nan" and "inf"
// are numbers here. A leading '+' and spaces around are fine.
bool ParseNumber(std::string_view text, double* value);

// The same of a number with one decimal comma, between digits or before one:
// "1,5", ",5"; false without a comma.
bool ParseDecimalComma(std::string_view text, double* value);

// The shortest text that reads back as the same number.
std::string ShortestText(double value);

// As a person would write what was computed (9 digits: one more than times of
// a day to the millisecond have): 109.995, not 109.99499999999999.
std::string RoundedText(double value);

// A cell as RFC 4180 writes it: quoted where it must be.
std::string CsvCell(const std::string& text);

// A word in single quotes, as a shell reads it back.
std::string ShellQuoted(const std::string& text);

template <typename Values, typename Value>
bool Contains(const Values& values, const Value& value) {
  return std::find(values.begin(), values.end(), value) != values.end();
}

// "a, b, c", of more than 24 "a, ..., x, and 3 more".
std::string JoinSome(std::vector<std::string> names);

// "1 cell", "2 cells".
std::string CountOf(size_t n, const std::string& noun);

}  // namespace sysid
