#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sysid/checks/check.h"

namespace sysid {

// Flags that mend, written so that they can be pasted: each repeats what the
// same flag says already, which may be given once only.

// What our column is read from: an expression, or its own name.
std::string SourceOf(const CheckInput& input, const std::string& column);

// The expressions "-x", "x*0.001", "x-y" of expressions.
std::string Negated(const std::string& expression);
std::string Times(const std::string& expression, const std::string& factor);
std::string Minus(const std::string& a, const std::string& b);

// What the names of one run's columns begin with where there are several, or
// where the flags name it so already: its file's name, or path, where the name
// is another's too, and a slash.
std::string RunScope(const std::vector<std::string>& runs,
                     const std::string& run);
std::string RunScope(const CheckInput& input, const std::string& run);

// The input with one of its runs alone: what was given for it by its name
// counts as what is given for all, and its remedies name it so.
CheckInput OfOneRun(const CheckInput& input, const Run& run);

// "--columns joint1.q=-pos1".
using NewColumns = std::vector<std::pair<std::string, std::string>>;
std::string ColumnsFlag(const CheckInput& input, const NewColumns& columns);
// "--shift joint1.q=0.01": so much more for each of these columns.
std::string ShiftFlag(const CheckInput& input,
                      const std::vector<std::string>& columns, double delay);
// "--ignore joint1.q@12.3:14.5,..." of spans in one run.
std::string IgnoreFlag(const CheckInput& input, const std::string& run,
                       const std::vector<std::string>& columns,
                       const std::vector<std::pair<double, double>>& spans);

// The value in such a text: of "--columns 'value'".
std::string FlagValue(const std::string& flag);

// Whether any run measures the column's channel, or has its effort.
bool Measures(const CheckInput& input, ChannelKind kind, int target);
bool IsDriven(const CheckInput& input, const Joint& joint);

}  // namespace sysid
