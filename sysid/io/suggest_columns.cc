#include "sysid/io/suggest_columns.h"

#include <algorithm>
#include <cctype>
#include <initializer_list>

#include "models/error.h"
#include "sysid/io/run_columns.h"

namespace sysid {
namespace {

constexpr char kRadiansPerDegree[] = "*0.0174532925";

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

// The column that looks like time, or -1.
int FindTime(const std::vector<std::string>& header) {
  for (size_t i = 0; i < header.size(); ++i) {
    if (LooksLikeTime(header[i])) return static_cast<int>(i);
  }
  return -1;
}

// The marker that this column is x, y or z of ("tip" for "tip.Y", where the
// other two are there), or "".
std::string MarkerOf(const std::string& column,
                     const std::vector<std::string>& header) {
  if (column.size() < 3 || column[column.size() - 2] != '.') return "";
  const std::string marker = column.substr(0, column.size() - 2);
  const char axis = column.back();
  if (axis < 'X' || axis > 'Z') return "";
  for (const char* other : {".X", ".Y", ".Z"}) {
    if (std::find(header.begin(), header.end(), marker + other) ==
        header.end()) {
      return "";
    }
  }
  return marker;
}

// Hinges and slides in order, columns that look like positions in order.
ColumnMap SuggestPositions(const Mechanism& mechanism,
                           const std::vector<std::string>& header,
                           int time_column) {
  ColumnMap map;
  size_t next = 0;
  for (const ColumnGroup& group : RunColumnGroups(mechanism)) {
    if (group.is_effort || group.kind != ChannelKind::kPosition) continue;
    while (next < header.size() &&
           (static_cast<int>(next) == time_column || header[next].empty() ||
            !LooksLikePosition(header[next]) ||
            !MarkerOf(header[next], header).empty())) {
      ++next;
    }
    if (next == header.size()) break;
    const bool degrees = ContainsAny(Lower(header[next]), {"deg"});
    map.push_back({group.columns[0],
                   header[next] + (degrees ? kRadiansPerDegree : ""), ""});
    ++next;
  }
  return map;
}

// The flag with `added`, as one types it.
std::string ColumnsFlag(const ColumnMap& given, const ColumnMap& added) {
  ColumnMap from_flag;
  for (const ColumnMapping& entry : given) {
    if (entry.place == "--columns") from_flag.push_back(entry);
  }
  std::vector<std::string> entries;
  for (const ColumnMapping& entry : MergeColumnMaps(from_flag, added)) {
    entries.push_back(entry.name + "=" + entry.expression);
  }
  const std::string value = Join(entries, ",");
  const bool plain = value.find_first_of(" []()\"$&;|<>#") == std::string::npos;
  return "--columns " + (plain ? value : "'" + value + "'");
}

}  // namespace

std::string TimeHint(const Mechanism& mechanism,
                     const std::vector<std::string>& header,
                     const ColumnMap& given) {
  const int time = FindTime(header);
  if (time < 0) return "name it by --columns t=COLUMN; " + ListColumns(header);
  ColumnMap added = {{"t", header[time] + TimeFactor(header[time]), ""}};
  const std::vector<std::string> names = RunColumnNames(mechanism);
  const bool measured =
      given.size() > 0 ||
      std::any_of(header.begin(), header.end(), [&](const std::string& name) {
        return std::find(names.begin(), names.end(), name) != names.end();
      });
  if (!measured) {
    const ColumnMap positions = SuggestPositions(mechanism, header, time);
    added.insert(added.end(), positions.begin(), positions.end());
  }
  return (header[0].starts_with('%') ? "take the '%' before the names away, or "
                                     : "") +
         ColumnsFlag(given, added);
}

std::string MeasuredHint(const Mechanism& mechanism,
                         const std::vector<std::string>& header,
                         int time_column, const ColumnMap& given) {
  std::vector<std::string> names;
  for (const ColumnGroup& group : RunColumnGroups(mechanism)) {
    const bool position = group.kind == ChannelKind::kPosition ||
                          group.kind == ChannelKind::kOrientation;
    if (group.is_effort || !position) continue;
    names.insert(names.end(), group.columns.begin(), group.columns.end());
  }
  const std::string would_be = "its columns would be " + Join(names);
  const ColumnMap added = SuggestPositions(mechanism, header, time_column);
  if (!added.empty()) return would_be + "; try " + ColumnsFlag(given, added);
  for (const std::string& column : header) {
    const std::string marker = MarkerOf(column, header);
    // With a W it is a rotation.
    if (marker.empty() || mechanism.links.empty() ||
        std::find(header.begin(), header.end(), marker + ".W") !=
            header.end()) {
      continue;
    }
    const std::string& link = mechanism.links.back().name;
    return "a marker is a frame: " +
           ColumnsFlag(given, {{link + ".px", marker + ".X*0.001", ""},
                               {link + ".py", marker + ".Y*0.001", ""},
                               {link + ".pz", marker + ".Z*0.001", ""}}) +
           " if it is in mm and z is up";
  }
  return would_be + "; map yours by --columns NAME=COLUMN; " +
         ListColumns(header);
}

std::string DegreesFlag(const std::string& name, const std::string& column,
                        const ColumnMap& given) {
  return ColumnsFlag(given, {{name, column + kRadiansPerDegree, ""}});
}

std::string DegreesHint(const std::string& name, const std::string& column,
                        const ColumnMap& given) {
  return DegreesFlag(name, column, given) +
         "  (if it is radians after all: " + name + "=" + column + "*1)";
}

}  // namespace sysid
