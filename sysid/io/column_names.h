#pragma once

#include <string>
#include <vector>

namespace sysid {

// What a recording's column says by its name: what it measures, and in which
// unit. Guesses, for hints.

// "Time [ms]" -> "time", "ms"; "pos_meas1" -> "pos", "meas", "1".
std::vector<std::string> WordsOf(const std::string& name);

enum class ColumnKind {
  kOther,
  kPosition,
  kVelocity,
  kEffort,
  kCommand,         // of a position
  kCommandedEffort  // "/torque_cmd/data[0]"
};
ColumnKind KindOf(const std::string& name);

// The words that say of which kind or in which unit it is, not whose it is.
bool IsKindOrUnit(const std::string& word);

// "*0.0174532925" where the name says degrees, "*2*pi" turns, "*0.001"
// millimetres or mN m; "" where it says nothing, or SI.
std::string FactorOf(const std::string& name, ColumnKind kind);

bool IsCalledTime(const std::string& name);
// "*0.001" where a time's name says ms.
std::string TimeFactor(const std::string& name);
// The column that looks like time, or -1.
int FindTime(const std::vector<std::string>& header);

}  // namespace sysid
