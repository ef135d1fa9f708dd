#include "sysid/io/suggest_columns.h"

#include <algorithm>
#include <cctype>
#include <initializer_list>

#include "models/error.h"
#include "sysid/io/cell.h"
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
  return std::any_of(words.begin(), words.end(),
                     [&](const char* word) { return Contains(own, word); });
}

bool IsCalledTime(const std::string& name) {
  return ContainsAny(Lower(name), {"time", "stamp", "clock"}) ||
         HasWord(name, {"t"});
}

// Not "omega [rad/s]".
bool IsInSeconds(const std::string& name) {
  return name.find('/') == std::string::npos &&
         HasWord(name, {"s", "sec", "secs", "seconds", "ms", "msec", "millis",
                        "us", "usec", "micros", "ns", "nsec"});
}

std::string TimeFactor(const std::string& name) {
  if (HasWord(name, {"ms", "msec", "millis", "milliseconds"})) return "*0.001";
  if (HasWord(name, {"us", "usec", "micros", "microseconds"})) return "*1e-6";
  if (HasWord(name, {"ns", "nsec", "nanos", "nanoseconds"})) return "*1e-9";
  return "";
}

bool IsCommand(const std::string& lower) {
  return ContainsAny(lower, {"ref", "des", "cmd", "con", "target", "set"});
}

std::string ListColumns(const std::vector<std::string>& header) {
  return "the file's columns are " + Join(header);
}

// The column that looks like time, or -1.
int FindTime(const std::vector<std::string>& header) {
  for (const auto looks_like_time : {IsCalledTime, IsInSeconds}) {
    const auto found =
        std::find_if(header.begin(), header.end(), looks_like_time);
    if (found != header.end()) return static_cast<int>(found - header.begin());
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
    if (!Contains(header, marker + other)) return "";
  }
  return marker;
}

// The w, x, y, z that this column is w of ("q1w" where there are "q1x", "q1y"
// and "q1z"), or nothing.
std::vector<std::string> QuaternionOf(const std::string& column,
                                      const std::vector<std::string>& header) {
  for (size_t i = 0; i < column.size(); ++i) {
    if (column[i] != 'w' && column[i] != 'W') continue;
    std::vector<std::string> names = {column};
    for (const char axis : {'x', 'y', 'z'}) {
      std::string name = column;
      name[i] = static_cast<char>(axis + column[i] - 'w');
      if (Contains(header, name)) names.push_back(name);
    }
    if (names.size() == 4) return names;
  }
  return {};
}

// A column's name as an expression.
std::string Quoted(const std::string& name) {
  const auto is_one_entry = [&] {
    try {
      const ColumnMap map = ParseColumnMap("t=" + name);
      return map.size() == 1 && map[0].expression == name;
    } catch (const InputError&) {
      return false;
    }
  };
  if (name.find_first_of("'\"") == std::string::npos && is_one_entry()) {
    return name;
  }
  const char mark = name.find('"') == std::string::npos ? '"' : '\'';
  return mark + name + mark;
}

// Joints in order, columns that look like their positions in order.
ColumnMap SuggestPositions(const Mechanism& mechanism,
                           const std::vector<std::string>& header,
                           int time_column) {
  std::vector<std::vector<std::string>> quaternions;
  std::vector<std::string> of_quaternions;
  for (const std::string& name : header) {
    const std::vector<std::string> quaternion = QuaternionOf(name, header);
    if (quaternion.empty()) continue;
    quaternions.push_back(quaternion);
    of_quaternions.insert(of_quaternions.end(), quaternion.begin(),
                          quaternion.end());
  }
  const std::vector<std::string> joints = mechanism.JointNames();
  std::vector<std::string> positions;
  for (size_t i = 0; i < header.size(); ++i) {
    const std::string& name = header[i];
    if (static_cast<int>(i) != time_column && !name.empty() &&
        (LooksLikePosition(name) || Contains(joints, name)) &&
        MarkerOf(name, header).empty() && !Contains(of_quaternions, name)) {
      positions.push_back(name);
    }
  }
  ColumnMap map;
  size_t position = 0, quaternion = 0;
  for (const ColumnGroup& group : RunColumnGroups(mechanism)) {
    if (group.is_effort) continue;
    if (group.kind == ChannelKind::kPosition && position < positions.size()) {
      const std::string& name = positions[position++];
      const bool degrees = ContainsAny(Lower(name), {"deg", "\u00b0"});
      map.push_back({group.columns[0],
                     degrees ? InRadians(Quoted(name)) : Quoted(name), ""});
    }
    if (group.kind == ChannelKind::kOrientation &&
        quaternion < quaternions.size()) {
      const std::vector<std::string>& names = quaternions[quaternion++];
      for (size_t i = 0; i < names.size(); ++i) {
        map.push_back({group.columns[i], Quoted(names[i]), ""});
      }
    }
  }
  return map;
}

// The columns of all joints' positions.
std::vector<std::string> PositionNames(const Mechanism& mechanism) {
  std::vector<std::string> names;
  for (const ColumnGroup& group : RunColumnGroups(mechanism)) {
    const bool position = group.kind == ChannelKind::kPosition ||
                          group.kind == ChannelKind::kOrientation;
    if (group.is_effort || !position) continue;
    names.insert(names.end(), group.columns.begin(), group.columns.end());
  }
  return names;
}

// Whether the file or the map has a column that is measured: an effort is none.
bool MeasuresAnything(const Mechanism& mechanism,
                      const std::vector<std::string>& header,
                      const ColumnMap& given) {
  for (const ColumnGroup& group : RunColumnGroups(mechanism)) {
    if (group.is_effort) continue;
    for (const std::string& name : group.columns) {
      const bool mapped =
          std::any_of(given.begin(), given.end(),
                      [&](const ColumnMapping& m) { return m.name == name; });
      if (mapped || Contains(header, name)) return true;
    }
  }
  return false;
}

std::string InShell(const std::string& value) {
  constexpr char kSpecial[] = " \t[](){}\"'`\\$&;|<>#!?~";
  const bool plain = value.find_first_of(kSpecial) == std::string::npos;
  return plain ? value : ShellQuoted(value);
}

// The flag with `added`, as one types it.
std::string ColumnsFlag(const ColumnMap& given, const ColumnMap& added) {
  ColumnMap from_flag;
  for (const ColumnMapping& entry : given) {
    if (entry.place == "--columns") from_flag.push_back(entry);
  }
  std::vector<std::string> entries;
  for (const ColumnMapping& entry : MergeByName(from_flag, added)) {
    entries.push_back(entry.name + "=" + entry.expression);
  }
  return "--columns " + InShell(Join(entries, ","));
}

}  // namespace

bool LooksLikePosition(const std::string& name) {
  const std::string lower = Lower(name);
  if (IsCommand(lower) ||
      ContainsAny(
          lower, {"vel", "speed", "acc", "dot", "qd", "omega", "rate", "/s",
                  "gyro", "tau", "torque", "effort", "force", "cur", "volt"})) {
    return false;
  }
  return ContainsAny(lower, {"pos", "theta", "angle", "phi", "enc", "deg",
                             "alpha", "rad"}) ||
         lower[0] == 'q' || HasWord(name, {"q", "x"});
}

bool LooksLikeVelocity(const std::string& name) {
  const std::string lower = Lower(name);
  return !IsCommand(lower) &&
         ContainsAny(lower, {"vel", "speed", "omega", "qd", "dot"});
}

bool LooksLikeEffort(const std::string& name) {
  const std::string lower = Lower(name);
  return !IsCommand(lower) &&
         ContainsAny(lower, {"tau", "torque", "effort", "force", "cur"});
}

std::string TimeHint(const Mechanism& mechanism,
                     const std::vector<std::string>& header,
                     const ColumnMap& given) {
  constexpr char kUnknown[] = "COLUMN";
  const int time = FindTime(header);
  bool complete = time >= 0;
  ColumnMap added = {
      {"t",
       complete ? Quoted(header[time]) + TimeFactor(header[time]) : kUnknown,
       ""}};
  if (!MeasuresAnything(mechanism, header, given)) {
    ColumnMap positions = SuggestPositions(mechanism, header, time);
    if (positions.empty()) {
      complete = false;
      for (const std::string& name : PositionNames(mechanism)) {
        positions.push_back({name, kUnknown, ""});
      }
    }
    added.insert(added.end(), positions.begin(), positions.end());
  }
  const std::string flag = ColumnsFlag(given, added);
  if (!complete) {
    return "name " + std::string(added.size() == 1 ? "it" : "them") + " by " +
           flag + "; " + ListColumns(header);
  }
  return (header[0].starts_with('%') ? "take the '%' before the names away, or "
                                     : "") +
         flag;
}

std::string MeasuredHint(const Mechanism& mechanism,
                         const std::vector<std::string>& header,
                         int time_column, const ColumnMap& given) {
  const std::string would_be =
      "its columns would be " + Join(PositionNames(mechanism));
  const ColumnMap added = SuggestPositions(mechanism, header, time_column);
  if (!added.empty()) return would_be + "; try " + ColumnsFlag(given, added);
  for (const std::string& column : header) {
    const std::string marker = MarkerOf(column, header);
    // With a W it is a rotation.
    if (marker.empty() || mechanism.links.empty() ||
        Contains(header, marker + ".W")) {
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

std::string InRadians(const std::string& column) {
  return column + kRadiansPerDegree;
}

std::string DegreesFlag(const std::string& name, const std::string& column,
                        const ColumnMap& given) {
  return ColumnsFlag(given, {{name, InRadians(column), ""}});
}

std::string DegreesHint(const std::string& name, const std::string& column,
                        const ColumnMap& given) {
  return DegreesFlag(name, column, given) +
         "  (if it is radians after all: " + name + "=" + column + "*1)";
}

}  // namespace sysid
