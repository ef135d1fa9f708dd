#include "sysid/checks/remedy.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/run_columns.h"

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
  if (!text.empty() &&
      text.find_first_of(" *()/'\"$&;[]") == std::string::npos) {
    return text;
  }
  return ShellQuoted(text);
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

std::string RunScope(const std::vector<std::string>& runs,
                     const std::string& run) {
  if (runs.size() < 2) return "";
  const auto name = [](const std::string& path) {
    return std::filesystem::path(path).filename().string();
  };
  int same = 0;
  for (const std::string& other : runs) same += name(other) == name(run);
  return (same > 1 ? run : name(run)) + "/";
}

std::string RunScope(const CheckInput& input, const std::string& run) {
  std::vector<std::string> runs = input.run_names;
  if (runs.empty()) {
    for (const Run* other : input.runs) runs.push_back(other->name);
  }
  const bool is_alone = runs.size() < 2;
  const std::string own =
      is_alone ? std::filesystem::path(run).filename().string() + "/"
               : RunScope(runs, run);
  // As the flags name it already, if they do: of two names one would win.
  for (const std::string& scope : {run + "/", own}) {
    const auto names_it = [&](const auto& entry) {
      return entry.name.starts_with(scope);
    };
    const auto& columns = input.flag_columns;
    const auto& shifts = input.flag_edits.shifts;
    if (std::any_of(columns.begin(), columns.end(), names_it) ||
        std::any_of(shifts.begin(), shifts.end(), names_it)) {
      return scope;
    }
  }
  return is_alone ? input.scope : own;
}

CheckInput OfOneRun(const CheckInput& input, const Run& run) {
  CheckInput alone = input;
  alone.runs = {&run};
  alone.columns = ColumnsOf(input.columns, run.name, input.model->mechanism());
  alone.scope = RunScope(input, run.name);
  return alone;
}

std::string ColumnsFlag(const CheckInput& input, const NewColumns& columns) {
  std::vector<std::string> parts;
  for (const ColumnMapping& mapping : input.flag_columns) {
    const bool changed = std::any_of(
        columns.begin(), columns.end(),
        [&](const auto& c) { return input.scope + c.first == mapping.name; });
    if (!changed) parts.push_back(mapping.name + "=" + mapping.expression);
  }
  for (const auto& [name, expression] : columns) {
    parts.push_back(input.scope + name + "=" + expression);
  }
  return "--columns " + Quoted(Join(parts, ","));
}

std::string ShiftFlag(const CheckInput& input,
                      const std::vector<std::string>& columns, double delay) {
  constexpr double kNone = 1e-9;  // s: what was given, undone
  std::vector<std::string> parts, added;
  std::vector<ChannelShift> others = input.flag_edits.shifts;
  for (const std::string& column : columns) {
    const std::string name = input.scope + column;
    double given = 0.0;  // to this run: its own shift wins over that of all
    bool is_own = false, is_of_all = false;
    for (const ChannelShift& shift : input.flag_edits.shifts) {
      const bool is_this = shift.name == name;
      is_of_all = is_of_all || (shift.name == column && !is_this);
      if (is_this || (shift.name == column && !is_own)) given = shift.delay;
      is_own = is_own || is_this;
    }
    std::erase_if(others,
                  [&](const ChannelShift& s) { return s.name == name; });
    const double all = given + delay;
    if (std::abs(all) >= kNone) {
      added.push_back(name + "=" + ShortNumber(all));
    } else if (is_of_all) {
      added.push_back(name + "=0");
    }
  }
  for (const ChannelShift& shift : others) parts.push_back(ToString(shift));
  parts.insert(parts.end(), added.begin(), added.end());
  return "--shift " + Quoted(Join(parts, ","));
}

std::string IgnoreFlag(const CheckInput& input, const std::string& run,
                       const std::vector<std::string>& columns,
                       const std::vector<std::pair<double, double>>& spans) {
  std::vector<std::string> parts;
  for (const IgnoredSpan& span : input.flag_edits.ignored) {
    parts.push_back(ToString(span));
  }
  const std::string scope = RunScope(input, run);
  for (const std::string& column : columns) {
    for (const auto& [from, to] : spans) {
      parts.push_back(ToString(IgnoredSpan{scope + column, from, to, ""}));
    }
  }
  return "--ignore " + Quoted(Join(parts, ","));
}

std::string FlagValue(const std::string& flag) {
  std::string value = flag.substr(flag.find(' ') + 1);
  if (value.size() > 1 && value.front() == '\'' && value.back() == '\'') {
    value = value.substr(1, value.size() - 2);
  }
  return value;
}

bool Measures(const CheckInput& input, ChannelKind kind, int target) {
  return std::any_of(input.runs.begin(), input.runs.end(), [&](const Run* run) {
    return FindChannel(*run, kind, target) != nullptr;
  });
}

bool IsDriven(const CheckInput& input, const Joint& joint) {
  return std::any_of(input.runs.begin(), input.runs.end(), [&](const Run* run) {
    return !run->effort.middleCols(joint.v_index, VelocitySize(joint))
                .isZero(0.0);
  });
}

}  // namespace sysid
