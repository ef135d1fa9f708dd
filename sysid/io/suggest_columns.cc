#include "sysid/io/suggest_columns.h"

#include <algorithm>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/column_names.h"
#include "sysid/io/match_columns.h"
#include "sysid/io/run_columns.h"

namespace sysid {
namespace {

constexpr char kRadiansPerDegree[] = "*0.0174532925";

std::string ListColumns(const std::vector<std::string>& header) {
  return "the file's columns are " + JoinSome(header);
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

bool Gives(const ColumnMap& given, const std::string& name) {
  return std::any_of(given.begin(), given.end(),
                     [&](const ColumnMapping& m) { return m.name == name; });
}

// Balls in order, quaternions in order; those columns, in `taken`.
ColumnMap SuggestQuaternions(const Mechanism& mechanism,
                             const std::vector<std::string>& header,
                             std::vector<std::string>* taken) {
  std::vector<std::vector<std::string>> quaternions;
  for (const std::string& name : header) {
    const std::vector<std::string> quaternion = QuaternionOf(name, header);
    if (quaternion.empty()) continue;
    quaternions.push_back(quaternion);
    taken->insert(taken->end(), quaternion.begin(), quaternion.end());
  }
  ColumnMap map;
  size_t next = 0;
  for (const ColumnGroup& group : RunColumnGroups(mechanism)) {
    if (group.is_effort || group.kind != ChannelKind::kOrientation ||
        next == quaternions.size()) {
      continue;
    }
    const std::vector<std::string>& names = quaternions[next++];
    for (size_t i = 0; i < names.size(); ++i) {
      map.push_back({group.columns[i], QuotedColumn(names[i]), ""});
    }
  }
  return map;
}

// What the names of the columns say that is neither in the file under our
// names nor given.
ColumnMatches Suggest(const Mechanism& mechanism,
                      const std::vector<std::string>& header, int time_column,
                      const ColumnMap& given) {
  std::vector<std::string> taken;
  const ColumnMap balls = SuggestQuaternions(mechanism, header, &taken);
  std::vector<std::string> columns;
  for (size_t i = 0; i < header.size(); ++i) {
    if (static_cast<int>(i) != time_column && !Contains(taken, header[i]) &&
        MarkerOf(header[i], header).empty()) {
      columns.push_back(header[i]);
    }
  }
  ColumnMatches found =
      MatchColumns(mechanism, columns, [&](const std::string& name) {
        return !Gives(given, name) && !Contains(header, name);
      });
  found.map.insert(found.map.begin(), balls.begin(), balls.end());
  return found;
}

// Of a table without names: the time, then the joints' positions, and where
// the number of columns is that, their velocities and efforts.
ColumnMap SuggestByNumber(const Mechanism& mechanism, size_t columns,
                          const ColumnMap& given) {
  std::vector<std::string> joints;
  for (const Joint& joint : mechanism.joints) {
    if (VelocitySize(joint) == 1) joints.push_back(joint.name);
  }
  ColumnMap map = {{"t", "#1", ""}};
  const bool all = columns == 1 + 3 * joints.size();
  for (const char* suffix : {".q", ".qd", ".tau"}) {
    for (const std::string& joint : joints) {
      if (map.size() == columns) break;
      map.push_back({joint + suffix, "#" + std::to_string(map.size() + 1), ""});
    }
    if (!all) break;
  }
  std::erase_if(map,
                [&](const ColumnMapping& m) { return Gives(given, m.name); });
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
      if (Gives(given, name) || Contains(header, name)) return true;
    }
  }
  return false;
}

std::string InShell(const std::string& value) {
  // "#" is special at the beginning of a word alone.
  constexpr char kSpecial[] = " \t[](){}\"'`\\$&;|<>!?~";
  const bool plain = value.find_first_of(kSpecial) == std::string::npos &&
                     !value.starts_with('#');
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

// Before a flag that nothing but the order of the columns gives.
std::string OrderWarning(const ColumnMatches& found) {
  if (found.by_order.empty()) return "";
  return "by the order of the columns, as no name says which is " +
         JoinSome(found.by_order) + ": ";
}

// Behind a flag: what it does not use.
std::string LeftColumns(const ColumnMatches& found) {
  if (found.left.empty()) return "";
  return "; no joint's by name: " + JoinSome(found.left) +
         " (a column may be an expression: joint1.q=width*0.5)";
}

}  // namespace

std::string Suggestion::Text(const ColumnMap& given) const {
  return before + (map.empty() ? "" : ColumnsFlag(given, map)) + after;
}

Suggestion SuggestWithTime(const Mechanism& mechanism,
                           const std::vector<std::string>& header,
                           const ColumnMap& given) {
  constexpr char kUnknown[] = "COLUMN";
  if (header[0] == "#1") {
    return {"",
            " if its columns are in this order; or put a row of names before "
            "it, such as t,joint1.q",
            SuggestByNumber(mechanism, header.size(), given), true};
  }
  const int time = FindTime(header);
  Suggestion hint;
  hint.complete = time >= 0;
  hint.map = {{"t",
               time >= 0 ? QuotedColumn(header[time]) + TimeFactor(header[time])
                         : kUnknown,
               ""}};
  ColumnMatches found = Suggest(mechanism, header, time, given);
  if (!MeasuresAnything(mechanism, header, given) &&
      !MeasuresAnything(mechanism, {}, found.map)) {
    hint.complete = false;
    for (const std::string& name : PositionNames(mechanism)) {
      found.map.push_back({name, kUnknown, ""});
    }
  }
  hint.map.insert(hint.map.end(), found.map.begin(), found.map.end());
  if (!hint.complete) {
    hint.before = hint.map.size() == 1 ? "name it by " : "name them by ";
    hint.after = "; " + ListColumns(header);
    return hint;
  }
  hint.before = OrderWarning(found);
  if (header[0].starts_with('%')) {
    hint.before = "take the '%' before the names away, or " + hint.before;
  }
  hint.after = LeftColumns(found);
  return hint;
}

Suggestion SuggestMeasured(const Mechanism& mechanism,
                           const std::vector<std::string>& header,
                           int time_column, const ColumnMap& given) {
  const std::string would_be =
      "its columns would be " + JoinSome(PositionNames(mechanism)) + "; ";
  const ColumnMatches found = Suggest(mechanism, header, time_column, given);
  if (MeasuresAnything(mechanism, {}, found.map)) {
    // A whole robot's would hide the flag.
    constexpr size_t kFew = 8;
    const bool few = PositionNames(mechanism).size() <= kFew;
    return {(few ? would_be : "") + OrderWarning(found) + "try ",
            LeftColumns(found), found.map, true};
  }
  if (header[0] == "#1") {
    return {would_be + "try ", " if its columns are in this order",
            SuggestByNumber(mechanism, header.size(), given), true};
  }
  for (const std::string& column : header) {
    const std::string marker = MarkerOf(column, header);
    // With a W it is a rotation.
    if (marker.empty() || mechanism.links.empty() ||
        Contains(header, marker + ".W")) {
      continue;
    }
    const std::string& link = mechanism.links.back().name;
    return {"a marker is a frame: ",
            " if it is in mm and z is up",
            {{link + ".px", marker + ".X*0.001", ""},
             {link + ".py", marker + ".Y*0.001", ""},
             {link + ".pz", marker + ".Z*0.001", ""}},
            true};
  }
  return {
      would_be + "map yours by --columns NAME=COLUMN; " + ListColumns(header),
      "",
      {},
      false};
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
