#include "sysid/checks/remedy.h"

#include <algorithm>
#include <filesystem>

#include "models/error.h"
#include "sysid/io/csv.h"

namespace sysid {
namespace {

// Whether an expression is a sum, so that a sign or a factor needs brackets: an
// operator that stands alone or behind a name that is no column's own.
bool IsSum(const std::string& expression) {
  for (size_t i = 1; i < expression.size(); ++i) {
    const char c = expression[i];
    if (c != '+' && c != '-') continue;
    const char before = expression[i - 1];
    if (before != 'e' && before != 'E') return true;
  }
  return false;
}

std::string Quoted(const std::string& text) {
  if (text.find_first_of(" *()/'\"$&;[]") == std::string::npos) return text;
  std::string quoted = "'";
  for (const char c : text) {
    quoted += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return quoted + "'";
}

}  // namespace

std::string SourceOf(const CheckInput& input, const std::string& column) {
  for (const ColumnMapping& mapping : input.columns) {
    if (mapping.name == column) return mapping.expression;
  }
  return column;
}

std::string Negated(const std::string& expression) {
  if (IsSum(expression)) return "-(" + expression + ")";
  if (!expression.empty() && expression[0] == '-') return expression.substr(1);
  return "-" + expression;
}

std::string Times(const std::string& expression, const std::string& factor) {
  return (IsSum(expression) ? "(" + expression + ")" : expression) + "*" +
         factor;
}

std::string Minus(const std::string& a, const std::string& b) {
  if (!b.empty() && b[0] == '-' && !IsSum(b)) return a + "+" + b.substr(1);
  return a + "-" + (IsSum(b) ? "(" + b + ")" : b);
}

std::string ColumnsFlag(const CheckInput& input, const NewColumns& columns) {
  std::vector<std::string> parts;
  for (const ColumnMapping& mapping : input.flag_columns) {
    const bool changed =
        std::any_of(columns.begin(), columns.end(),
                    [&](const auto& c) { return c.first == mapping.name; });
    if (!changed) parts.push_back(mapping.name + "=" + mapping.expression);
  }
  for (const auto& [name, expression] : columns) {
    parts.push_back(name + "=" + expression);
  }
  return "--columns " + Quoted(Join(parts, ","));
}

std::string ShiftFlag(const CheckInput& input, const std::string& column,
                      double delay) {
  std::vector<std::string> parts;
  for (const ChannelShift& shift : input.flag_edits.shifts) {
    if (shift.name == column) {
      delay += shift.delay;
    } else {
      parts.push_back(shift.name + "=" + ShortestText(shift.delay));
    }
  }
  parts.push_back(column + "=" + ShortNumber(delay));
  return "--shift " + Join(parts, ",");
}

std::string IgnoreFlag(const CheckInput& input, const std::string& run,
                       const std::vector<std::string>& columns,
                       const std::vector<std::pair<double, double>>& spans) {
  std::vector<std::string> parts;
  const auto add = [&](const std::string& of, const std::string& name,
                       double from, double to) {
    parts.push_back((of.empty() ? "" : of + "/") + name + "@" +
                    ShortestText(from) + ":" + ShortestText(to));
  };
  for (const IgnoredSpan& span : input.flag_edits.ignored) {
    add(span.run, span.name, span.t_start, span.t_end);
  }
  const std::string of = input.runs.size() > 1
                             ? std::filesystem::path(run).filename().string()
                             : "";
  for (const std::string& column : columns) {
    for (const auto& [from, to] : spans) add(of, column, from, to);
  }
  return "--ignore " + Quoted(Join(parts, ","));
}

const Channel* FindChannel(const Run& run, ChannelKind kind, int target) {
  for (const Channel& channel : run.channels) {
    if (channel.kind == kind && channel.target == target) return &channel;
  }
  return nullptr;
}

bool Measures(const CheckInput& input, ChannelKind kind, int target) {
  return std::any_of(input.runs.begin(), input.runs.end(), [&](const Run* run) {
    return FindChannel(*run, kind, target) != nullptr;
  });
}

bool IsDriven(const CheckInput& input, const Joint& joint) {
  return std::any_of(input.runs.begin(), input.runs.end(), [&](const Run* run) {
    return !run->effort.middleCols(joint.v_index, VelocitySize(joint.type))
                .isZero(0.0);
  });
}

}  // namespace sysid
