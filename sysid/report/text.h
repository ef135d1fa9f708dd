#pragma once

#include <string>
#include <vector>

#include "sysid/estimation/estimates.h"
#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/fit.h"

namespace sysid {

// What the reports on the terminal share.

inline constexpr const char* kBold = "\033[1m";
inline constexpr const char* kRed = "\033[31m";
inline constexpr const char* kGreen = "\033[32m";
inline constexpr const char* kReset = "\033[0m";

__attribute__((format(printf, 1, 2))) std::string Format(const char* format,
                                                         ...);
// An error in multiples of the noise, in a sentence: three digits, and never an
// exponent where people read on ("1090").
std::string Times(double error);
std::string Plural(int count, const std::string& word);

// As many digits as the standard error makes meaningful, and two more.
std::string Value(double value, double std_error);

// How long a fit's segments are: "0.5 s", or "0.5 to 1.2 s" where they differ.
std::string SegmentLengths(const Fit& fit);

// A line of the open predictions of each run.
std::string OpenLines(const std::vector<OpenError>& open,
                      const std::string& label);

}  // namespace sysid
