#include "sysid/io/column_names.h"

#include <algorithm>
#include <cctype>
#include <initializer_list>

#include "sysid/io/cell.h"

namespace sysid {
namespace {

using Letters = std::initializer_list<const char*>;

std::string Lower(std::string text) {
  for (char& c : text) {
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return text;
}

bool ContainsAny(const std::string& text, Letters parts) {
  return std::any_of(parts.begin(), parts.end(), [&](const char* part) {
    return text.find(part) != std::string::npos;
  });
}

bool HasWord(const std::string& name, Letters words) {
  const std::vector<std::string> own = WordsOf(name);
  return std::any_of(words.begin(), words.end(),
                     [&](const char* word) { return Contains(own, word); });
}

// Not "omega [rad/s]".
bool IsInSeconds(const std::string& name) {
  return name.find('/') == std::string::npos &&
         HasWord(name, {"s", "sec", "secs", "seconds", "ms", "msec", "millis",
                        "us", "usec", "micros", "ns", "nsec"});
}

bool SaysCommand(const std::string& lower) {
  return ContainsAny(
      lower, {"ref", "des", "cmd", "con", "target", "set", "goal", "soll"});
}

bool SaysEffort(const std::string& name) {
  return ContainsAny(Lower(name), {"tau", "torque", "effort", "force", "cur",
                                   "moment", "kraft", "trq"}) ||
         HasWord(name, {"eff", "nm"});
}

bool SaysVelocity(const std::string& name) {
  return ContainsAny(Lower(name), {"vel", "speed", "omega", "qd", "dq", "dot",
                                   "geschw", "drehzahl", "/s", "rpm"});
}

bool SaysPosition(const std::string& name) {
  const std::string lower = Lower(name);
  return ContainsAny(lower, {"pos", "theta", "angle", "phi", "enc", "deg",
                             "alpha", "rad", "winkel", "tick", "\u00b0"}) ||
         lower[0] == 'q' ||
         HasWord(name, {"q", "x", "mm", "cm", "rev", "revs", "turns"});
}

}  // namespace

std::vector<std::string> WordsOf(const std::string& name) {
  std::vector<std::string> words(1);
  const auto digit = [](char c) {
    return std::isdigit(static_cast<unsigned char>(c)) != 0;
  };
  for (const char c : Lower(name)) {
    const bool in_word = std::isalnum(static_cast<unsigned char>(c));
    const bool ends = !in_word || (!words.back().empty() &&
                                   digit(words.back().back()) != digit(c));
    if (ends && !words.back().empty()) words.emplace_back();
    if (in_word) words.back() += c;
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

ColumnKind KindOf(const std::string& name) {
  if (name.empty()) return ColumnKind::kOther;
  const bool command = SaysCommand(Lower(name));
  if (SaysEffort(name)) {
    return command ? ColumnKind::kCommandedEffort : ColumnKind::kEffort;
  }
  if (SaysVelocity(name)) {
    return command ? ColumnKind::kOther : ColumnKind::kVelocity;
  }
  if (ContainsAny(Lower(name), {"acc", "rate", "gyro", "volt"})) {
    return ColumnKind::kOther;
  }
  if (!SaysPosition(name)) return ColumnKind::kOther;
  return command ? ColumnKind::kCommand : ColumnKind::kPosition;
}

bool IsKindOrUnit(const std::string& word) {
  return IsCalledTime(word) || KindOf(word) != ColumnKind::kOther ||
         SaysCommand(word) ||
         HasWord(word, {"s", "ms", "m", "n", "meas", "measured", "actual",
                        "act", "state", "states", "data", "joint", "joints"});
}

std::string FactorOf(const std::string& name, ColumnKind kind) {
  if (kind == ColumnKind::kEffort || kind == ColumnKind::kCommandedEffort) {
    return HasWord(name, {"mnm"}) ? "*0.001" : "";
  }
  if (HasWord(name, {"rpm"})) return "*2*pi/60";
  if (ContainsAny(Lower(name), {"deg", "\u00b0"})) return "*0.0174532925";
  if (HasWord(name, {"rev", "revs", "turns"})) return "*2*pi";
  if (HasWord(name, {"mm"})) return "*0.001";
  if (HasWord(name, {"cm"})) return "*0.01";
  return "";
}

bool IsCalledTime(const std::string& name) {
  return ContainsAny(Lower(name), {"time", "stamp", "clock", "zeit"}) ||
         HasWord(name, {"t"});
}

std::string TimeFactor(const std::string& name) {
  if (HasWord(name, {"ms", "msec", "millis", "milliseconds"})) return "*0.001";
  if (HasWord(name, {"us", "usec", "micros", "microseconds"})) return "*1e-6";
  if (HasWord(name, {"ns", "nsec", "nanos", "nanoseconds"})) return "*1e-9";
  return "";
}

int FindTime(const std::vector<std::string>& header) {
  for (const auto looks_like_time : {IsCalledTime, IsInSeconds}) {
    const auto found =
        std::find_if(header.begin(), header.end(), looks_like_time);
    if (found != header.end()) return static_cast<int>(found - header.begin());
  }
  return -1;
}

}  // namespace sysid
