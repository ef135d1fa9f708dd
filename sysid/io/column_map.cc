#include "sysid/io/column_map.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "models/error.h"
#include "sysid/io/csv.h"
#include "sysid/io/run_columns.h"

namespace sysid {
namespace {

// What follows a column in an expression: { (*|/) number } [ (+|-) number ].
struct Tail {
  double factor = 1.0;
  double offset = 0.0;
  bool has_factor = false;
  std::string fault;  // "" where the tail could be read
};

// Where the number at the beginning of `text` ends: at the next operator that
// is not the sign of an exponent.
size_t OperandEnd(std::string_view text) {
  size_t i = 0;
  while (i < text.size() && text[i] == ' ') ++i;
  if (i < text.size() && (text[i] == '-' || text[i] == '+')) ++i;
  for (; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '*' || c == '/') return i;
    const bool exponent = i > 0 && (text[i - 1] == 'e' || text[i - 1] == 'E');
    if ((c == '+' || c == '-') && !exponent) return i;
  }
  return i;
}

Tail ReadTail(std::string_view text) {
  Tail tail;
  for (text = Trim(text); !text.empty(); text = Trim(text)) {
    const char op = text[0];
    if (op != '*' && op != '/' && op != '+' && op != '-') {
      tail.fault = Shown(text) + " is not a factor";
      return tail;
    }
    text.remove_prefix(1);
    const size_t end = OperandEnd(text);
    const std::string_view operand = Trim(text.substr(0, end));
    text.remove_prefix(end);
    double number;
    if (!ParseNumber(operand, &number) || !std::isfinite(number)) {
      tail.fault = (op == '*' || op == '/' ? "factor " : "offset ") +
                   Shown(operand) + " is not a number";
      return tail;
    }
    if (op == '*' || op == '/') {
      if (number == 0.0) {
        tail.fault = "factor " + Shown(operand) + " is zero";
        return tail;
      }
      // After an offset a factor scales it too: (a + b) * c is not written
      // here, and precedence would say a + b * c.
      if (tail.offset != 0.0) {
        tail.fault = "a factor after an offset";
        return tail;
      }
      tail.factor = op == '*' ? tail.factor * number : tail.factor / number;
      tail.has_factor = true;
    } else {
      tail.offset += op == '+' ? number : -number;
    }
  }
  if (!std::isfinite(tail.factor) || tail.factor == 0.0) {
    tail.fault = "the factors' product is " + ShortestText(tail.factor);
  }
  return tail;
}

// The expression without the operators and numbers at its end: most likely the
// name of a column that is not there.
std::string_view LikelyColumn(std::string_view body) {
  while (true) {
    const size_t op = body.find_last_of("*/+-");
    if (op == std::string_view::npos || op == 0) return body;
    double number;
    const bool is_number = ParseNumber(body.substr(op + 1), &number);
    if (!is_number && body[op] != '*') return body;
    body = Trim(body.substr(0, op));
  }
}

[[noreturn]] void ThrowNoColumn(const ColumnMapping& entry,
                                std::string_view body,
                                const std::vector<std::string>& header,
                                const std::string& path) {
  // "run-2" is rather a slip for the column "run-1" than "run" minus 2.
  const bool is_name = body.find('*') == std::string_view::npos &&
                       !NearestName(std::string(body), header).empty();
  const std::string column(is_name ? body : LikelyColumn(body));
  double number;
  const size_t star = body.find('*');
  std::string hint = NameHint(column, header);
  if (star != std::string_view::npos &&
      ParseNumber(body.substr(0, star), &number)) {
    hint = "the factor goes behind the column: " + entry.name + "=" +
           std::string(Trim(body.substr(star + 1))) + "*" +
           std::string(Trim(body.substr(0, star)));
  }
  throw InputError(
      entry.place,
      path + " has no column " + Shown(column) + " (for '" + entry.name + "')",
      hint);
}

ColumnSource ResolveEntry(const ColumnMapping& entry,
                          const std::vector<std::string>& header,
                          const std::string& path) {
  const std::string_view whole = Trim(entry.expression);
  ColumnSource source;
  source.name = entry.name;
  const auto exact = std::find(header.begin(), header.end(), whole);
  if (exact != header.end()) {
    source.column = static_cast<int>(exact - header.begin());
    return source;
  }
  // With and without the leading minus: a column may begin with one.
  std::string fault;
  size_t longest_fault = 0;
  for (const bool minus : {false, true}) {
    if (minus && !whole.starts_with('-')) continue;
    const std::string_view body = minus ? Trim(whole.substr(1)) : whole;
    std::optional<Tail> best;
    for (size_t i = 0; i < header.size(); ++i) {
      const std::string& name = header[i];
      if (name.empty() || !body.starts_with(name)) continue;
      if (best && name.size() <= header[source.column].size()) continue;
      const std::string_view rest = Trim(body.substr(name.size()));
      const Tail tail = ReadTail(rest);
      if (tail.fault.empty()) {
        best = tail;
        source.column = static_cast<int>(i);
      } else if (std::string_view("*/+-").find(rest[0]) !=
                     std::string_view::npos &&
                 name.size() > longest_fault) {
        fault = tail.fault;
        longest_fault = name.size();
      }
    }
    if (!best) continue;
    source.factor = minus ? -best->factor : best->factor;
    source.offset = best->offset;
    source.has_factor = minus || best->has_factor;
    return source;
  }
  if (!fault.empty()) {
    throw InputError(
        entry.place,
        fault + " (in '" + entry.name + "=" + entry.expression + "')",
        "write column*number, such as " + entry.name + "=deg*0.0174532925");
  }
  ThrowNoColumn(entry, whole.starts_with('-') ? Trim(whole.substr(1)) : whole,
                header, path);
}

}  // namespace

ColumnMap ParseColumnMap(const std::string& text, const std::string& place) {
  ColumnMap map;
  if (Trim(text).empty()) return map;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
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

ColumnMap MergeColumnMaps(const ColumnMap& base, const ColumnMap& winner) {
  ColumnMap merged = winner;
  for (const ColumnMapping& entry : base) {
    const bool overruled = std::any_of(
        winner.begin(), winner.end(),
        [&](const ColumnMapping& w) { return w.name == entry.name; });
    if (!overruled) merged.push_back(entry);
  }
  return merged;
}

std::vector<ColumnSource> ResolveColumns(const ColumnMap& map,
                                         const std::vector<std::string>& header,
                                         const std::string& path,
                                         const Mechanism& mechanism) {
  const std::vector<std::string> names = RunColumnNames(mechanism);
  std::vector<ColumnSource> sources;
  for (const ColumnMapping& entry : map) {
    if (std::find(names.begin(), names.end(), entry.name) == names.end()) {
      const ColumnNameFault fault = ExplainUnknownColumn(entry.name, mechanism);
      throw InputError(entry.place, fault.what, fault.hint);
    }
    sources.push_back(ResolveEntry(entry, header, path));
  }
  return sources;
}

}  // namespace sysid
