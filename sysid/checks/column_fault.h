#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sysid/checks/check.h"

namespace sysid {

// What mends one column: it is read `delay` seconds earlier, or, where
// `expression` is given, by an expression of what `from` is read from.
struct ColumnFix {
  std::string column;
  std::string from;
  std::function<std::string(const std::string& source)> expression;
  double delay = 0.0;
};

// A fault of columns of one run that flags mend.
struct ColumnFault {
  Finding finding;  // its place and remedies are filled in by AddTogether
  const Run* run = nullptr;
  std::vector<std::string> columns;
  // A factor or a delay: of like ones the cause is one.
  double size = 1.0;
  // The first is meant; each other does as much.
  std::vector<std::vector<ColumnFix>> fixes;
};

// Whether two may have one cause: the same fault, of the same size but for what
// noise makes of it.
bool IsAlike(const ColumnFault& a, const ColumnFault& b);

// One finding, with one flag that can be pasted, for what is wrong in the same
// way: with several columns of a run, and with all runs.
void AddTogether(const CheckInput& input, std::vector<ColumnFault> faults,
                 std::vector<Finding>* findings);

}  // namespace sysid
