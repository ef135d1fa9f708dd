#include "sysid/io/suggest_columns.h"

#include <algorithm>
#include <cctype>
#include <initializer_list>

#include "models/error.h"
#include "sysid/io/run_columns.h"

namespace sysid {
namespace {

std::string Lower(std::string text) {
  for (char& c : text) {
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return text;
}

bool ContainsAny(const std::string& text,
                 std::initializer_list<const char*> words) {
  return std::any_of(words.begin(), words.end(), [&](const char* word) {
    return text.find(word) != std::string::npos;
  });
}

// The words of a name: "Time [ms]" -> "time", "ms".
std::vector<std::string> Words(const std::string& name) {
  std::vector<std::string> words(1);
  for (const char c : Lower(name)) {
    if (std::isalnum(static_cast<unsigned char>(c))) {
      words.back() += c;
    } else if (!words.back().empty()) {
      words.emplace_back();
    }
  }
  return words;
}

bool HasWord(const std::string& name,
             std::initializer_list<const char*> words) {
  const std::vector<std::string> own = Words(name);
  return std::any_of(words.begin(), words.end(), [&](const char* word) {
    return std::find(own.begin(), own.end(), word) != own.end();
  });
}

bool LooksLikeTime(const std::string& name) {
  return ContainsAny(Lower(name), {"time", "stamp", "clock"}) ||
         HasWord(name, {"t", "s", "sec", "secs", "seconds", "ms", "msec",
                        "millis", "us", "usec", "micros", "ns", "nsec"});
}

std::string TimeFactor(const std::string& name) {
  if (HasWord(name, {"ms", "msec", "millis", "milliseconds"})) return "*0.001";
  if (HasWord(name, {"us", "usec", "micros", "microseconds"})) return "*1e-6";
  if (HasWord(name, {"ns", "nsec", "nanos", "nanoseconds"})) return "*1e-9";
  return "";
}

bool LooksLikePosition(const std::string& name) {
  const std::string lower = Lower(name);
  if (ContainsAny(lower, {"vel", "speed", "acc", "dot", "qd", "omega", "tau",
                          "torque", "effort", "force", "cur", "volt", "ref",
                          "des", "cmd", "con", "target", "set"})) {
    return false;
  }
  return ContainsAny(lower, {"pos", "theta", "angle", "phi", "enc", "deg",
                             "alpha", "rad"}) ||
         lower[0] == 'q' || HasWord(name, {"q", "x"});
}

std::string ListColumns(const std::vector<std::string>& header) {
  return "the file's columns are " + Join(header);
}

}  // namespace

std::string SuggestTimeColumn(const std::vector<std::string>& header) {
  for (const std::string& name : header) {
    if (LooksLikeTime(name)) {
      return "--columns t=" + name + TimeFactor(name);
    }
  }
  return "name it by --columns t=COLUMN; " + ListColumns(header);
}

std::string SuggestMeasuredColumns(const Mechanism& mechanism,
                                   const std::vector<std::string>& header,
                                   int time_column) {
  // Hinges and slides: one column each.
  std::vector<std::string> wanted;
  std::vector<std::string> names;
  for (const ColumnGroup& group : RunColumnGroups(mechanism)) {
    if (group.is_effort) continue;
    if (group.kind == ChannelKind::kPosition) {
      wanted.push_back(group.columns[0]);
    }
    if (group.kind == ChannelKind::kPosition ||
        group.kind == ChannelKind::kOrientation) {
      names.insert(names.end(), group.columns.begin(), group.columns.end());
    }
  }
  std::vector<std::string> candidates;
  for (size_t i = 0; i < header.size(); ++i) {
    if (static_cast<int>(i) != time_column && !header[i].empty() &&
        LooksLikePosition(header[i])) {
      candidates.push_back(header[i]);
    }
  }
  std::vector<std::string> entries;
  for (size_t i = 0; i < std::min(wanted.size(), candidates.size()); ++i) {
    const bool degrees = ContainsAny(Lower(candidates[i]), {"deg"});
    entries.push_back(wanted[i] + "=" + candidates[i] +
                      (degrees ? "*0.0174532925" : ""));
  }
  const std::string read = "its columns would be " + Join(names);
  if (!entries.empty()) return read + "; try --columns " + Join(entries, ",");
  return read + "; map yours by --columns NAME=COLUMN; " + ListColumns(header);
}

}  // namespace sysid
