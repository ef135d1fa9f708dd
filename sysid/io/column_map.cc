#include "sysid/io/column_map.h"

#include <algorithm>
#include <cctype>
#include <string_view>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/run_columns.h"

namespace sysid {
namespace {

ColumnSource ResolveEntry(const ColumnMapping& entry,
                          const std::vector<std::string>& header,
                          const std::string& path) {
  ColumnSource source;
  source.name = entry.name;
  source.text = std::string(Trim(entry.expression));
  ExpressionFault fault;
  if (ParseExpression(source.text, header, &source.expression, &fault)) {
    return source;
  }
  std::string where = " (for '" + entry.name + "'";
  if (fault.column != source.text) {
    where += ", character " + std::to_string(fault.at + 1) + " of " +
             Shown(source.text);
  }
  throw InputError(
      entry.place,
      (fault.column.empty() ? fault.what : path + " has " + fault.what) +
          where + ")",
      fault.hint);
}

// Where the parenthesis at `begin` is closed; `begin` if it is not.
size_t ParenthesisEnd(const std::string& text, size_t begin) {
  int depth = 0;
  for (size_t i = begin; i < text.size(); ++i) {
    if (text[i] == '(') ++depth;
    if (text[i] == ')' && --depth == 0) return i;
  }
  return begin;
}

// Where the entry that begins at `begin` ends: at a comma outside of quotes and
// parentheses ("pos(:,2)"). Both open only if they are closed, a quotation mark
// only where an operand may begin.
size_t EntryEnd(const std::string& text, size_t begin) {
  char before = ',';
  for (size_t i = begin; i < text.size(); ++i) {
    const char c = text[i];
    if (c == ',') return i;
    if ((c == '\'' || c == '"') &&
        std::string_view("=+-*/(").find(before) != std::string_view::npos) {
      const size_t close = text.find(c, i + 1);
      if (close != std::string::npos) i = close;
    } else if (c == '(') {
      i = ParenthesisEnd(text, i);
    }
    if (!IsBlank(c)) before = c;
  }
  return text.size();
}

}  // namespace

std::string ColumnSource::Describe() const {
  return (expression.is_column() ? "column " : "") + Shown(text) +
         (text == name ? "" : " (" + name + ")");
}

ColumnMap ParseColumnMap(const std::string& text, const std::string& place) {
  ColumnMap map;
  if (Trim(text).empty()) return map;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = EntryEnd(text, begin);
    const std::string_view entry =
        Trim(std::string_view(text).substr(begin, end - begin));
    begin = end + 1;
    const size_t equals = entry.find('=');
    const std::string hint =
        "write name=column or name=column*factor, such "
        "as joint1.q=pos1*0.0174532925";
    if (equals == std::string_view::npos) {
      throw InputError(place, Shown(entry) + " has no '='", hint);
    }
    ColumnMapping mapping{std::string(Trim(entry.substr(0, equals))),
                          std::string(Trim(entry.substr(equals + 1))), place};
    if (mapping.name.empty() || mapping.expression.empty()) {
      throw InputError(
          place,
          Shown(entry) + (mapping.name.empty() ? " has no name before '='"
                                               : " has no column after '='"),
          hint);
    }
    for (const ColumnMapping& other : map) {
      if (other.name != mapping.name) continue;
      throw InputError(place,
                       "'" + mapping.name +
                           "' is given twice: " + Shown(other.expression) +
                           " and " + Shown(mapping.expression),
                       "keep one of them");
    }
    map.push_back(std::move(mapping));
  }
  return map;
}

ScopedName RunColumn(const std::string& text, const Mechanism& mechanism) {
  const std::vector<std::string> names = RunColumnNames(mechanism);
  const std::vector<std::string> held = HeldColumnNames(mechanism);
  const std::vector<std::string> followers = FollowerColumnNames(mechanism);
  return SplitScope(text, [&](const std::string& name) {
    return Contains(names, name) || Contains(held, name) ||
           Contains(followers, name);
  });
}

ColumnMap ColumnsOf(const ColumnMap& map, const std::string& path,
                    const Mechanism& mechanism) {
  return EntriesOf(map, path, [&](const std::string& name) {
    return RunColumn(name, mechanism);
  });
}

bool IsOwnInput(const std::string& name, const Mechanism& mechanism) {
  const auto letter = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
  };
  return !name.empty() && !std::isdigit(static_cast<unsigned char>(name[0])) &&
         std::all_of(name.begin(), name.end(), letter) &&
         NearestName(name, RunColumnNames(mechanism)).empty();
}

std::vector<std::string> OwnInputs(const ColumnMap& map,
                                   const Mechanism& mechanism) {
  std::vector<std::string> names;
  for (const ColumnMapping& entry : map) {
    const std::string name = RunColumn(entry.name, mechanism).name;
    if (IsOwnInput(name, mechanism) && !Contains(names, name)) {
      names.push_back(name);
    }
  }
  return names;
}

std::vector<ColumnSource> ResolveColumns(const ColumnMap& map,
                                         const std::vector<std::string>& header,
                                         const std::string& path,
                                         const Mechanism& mechanism) {
  const std::vector<std::string> names = RunColumnNames(mechanism);
  const std::vector<std::string> held = HeldColumnNames(mechanism);
  const std::vector<std::string> followers = FollowerColumnNames(mechanism);
  std::vector<ColumnSource> sources;
  for (const ColumnMapping& entry : ColumnsOf(map, path, mechanism)) {
    if (Contains(held, entry.name)) {
      // Of no use, and no fault where the file does not have it.
      ColumnSource source;
      source.name = entry.name;
      source.text = std::string(Trim(entry.expression));
      ExpressionFault fault;
      if (ParseExpression(source.text, header, &source.expression, &fault)) {
        sources.push_back(source);
      }
      continue;
    }
    if (!Contains(names, entry.name) && !Contains(followers, entry.name) &&
        !IsOwnInput(entry.name, mechanism)) {
      const ColumnNameFault fault = ExplainUnknownColumn(entry.name, mechanism);
      throw InputError(entry.place, fault.what, fault.hint);
    }
    sources.push_back(ResolveEntry(entry, header, path));
  }
  return sources;
}

}  // namespace sysid
