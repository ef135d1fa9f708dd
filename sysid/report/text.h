#pragma once

#include <string>
#include <vector>

#include "sysid/estimation/estimates.h"
#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/fit.h"
#include "sysid/io/cell.h"

namespace sysid {

// What the reports on the terminal share.

inline constexpr const char* kBold = "\033[1m";
inline constexpr const char* kRed = "\033[31m";
inline constexpr const char* kGreen = "\033[32m";

// An error in multiples of the noise, in a sentence: three digits, and never an
// exponent where people read on ("1090").
std::string Times(double error);

// The unit of all positions; empty where they have several.
std::string CommonUnit(const std::vector<ChannelError>& channels);

// "0.0012 rad (fit 99.6 %), 1.03 times the noise"; without the first where
// there is no common unit.
std::string ErrorWords(const ErrorSummary& error, const std::string& unit);
std::string ErrorWords(const RunErrors& errors);

// In bold, red or green (kBold, ...), where there is `colour`.
std::string Paint(bool colour, const char* code, const std::string& text);

// "0.012", "<1e-12"; "-" where there is none (NaN).
std::string Probability(double p);

// " m", of a unit behind a number; "" where it has none ("-").
std::string Behind(const std::string& unit);
// " (fit 99.2 %)", (8.1); nothing where nothing moved or the dynamics fail.
std::string OfTheMotion(double fit_percent);

// As many digits as the standard error makes meaningful, and two more.
std::string Value(double value, double std_error);

// How long a fit's segments are: "0.5 s", or "0.5 to 1.2 s" where they differ.
std::string SegmentLengths(const Fit& fit);

// A line of the open prediction of each run, whose kind is "" or "held-out ";
// of more than a dozen runs, per channel the median and the worst.
std::string OpenLines(const std::vector<OpenError>& open,
                      const std::string& kind);

// Few with `between` two of them, many by their kind: "viscous_damping (joint1,
// joint2), armature (joint1)".
std::string ListEffects(const std::vector<std::string>& names,
                        const char* between);

// Whether bodies show in combinations only: the parameters one by one are many,
// and say less than the BaseTable.
bool ShowsCombinations(const Fit& fit);
std::string BaseTable(const Fit& fit);

// What the equations of motion leave of each joint's effort, where it has one:
// up to this frequency, Hz, where it is known.
std::string EffortLine(const std::string& label,
                       const std::vector<EffortError>& efforts,
                       double cut_off_hz);

}  // namespace sysid
