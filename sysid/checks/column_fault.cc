#include "sysid/checks/column_fault.h"

#include <algorithm>
#include <cmath>

#include "models/error.h"
#include "sysid/checks/remedy.h"

namespace sysid {
namespace {

// Of one cause: what sizes that are estimated from noisy numbers may differ by.
// A slope of some hundred windows is good to a tenth of it.
constexpr double kAlike = 0.02;

template <typename T>
void Append(const std::vector<T>& from, std::vector<T>* to) {
  to->insert(to->end(), from.begin(), from.end());
}

// Those of one run that are alike, as one; not where a column would be in it
// twice.
std::vector<ColumnFault> JoinedByRun(std::vector<ColumnFault> faults) {
  std::vector<ColumnFault> joined;
  for (ColumnFault& fault : faults) {
    const auto like =
        std::find_if(joined.begin(), joined.end(), [&](const ColumnFault& f) {
          return f.run == fault.run && IsAlike(f, fault) &&
                 std::find_first_of(f.columns.begin(), f.columns.end(),
                                    fault.columns.begin(),
                                    fault.columns.end()) == f.columns.end();
        });
    if (like == joined.end()) {
      joined.push_back(std::move(fault));
      continue;
    }
    Append(fault.columns, &like->columns);
    for (size_t i = 0; i < std::min(fault.fixes.size(), like->fixes.size());
         ++i) {
      Append(fault.fixes[i], &like->fixes[i]);
    }
  }
  return joined;
}

std::string FlagOf(const CheckInput& input, const std::vector<ColumnFix>& fix) {
  NewColumns columns;
  std::vector<std::string> late;
  for (const ColumnFix& one : fix) {
    const bool is_there =  // the clock of all
        std::any_of(columns.begin(), columns.end(), [&](const auto& column) {
          return column.first == one.column;
        });
    if (is_there) continue;
    if (one.expression) {
      columns.push_back(
          {one.column, one.expression(SourceOf(input, one.from))});
    } else {
      late.push_back(one.column);
    }
  }
  return late.empty() ? ColumnsFlag(input, columns)
                      : ShiftFlag(input, late, fix.front().delay);
}

}  // namespace

bool IsAlike(const ColumnFault& a, const ColumnFault& b) {
  return a.finding.fault == b.finding.fault &&
         a.finding.severity == b.finding.severity &&
         std::abs(a.size - b.size) <=
             kAlike * std::min(std::abs(a.size), std::abs(b.size));
}

void AddTogether(const CheckInput& input, std::vector<ColumnFault> faults,
                 std::vector<Finding>* findings) {
  faults = JoinedByRun(std::move(faults));
  const size_t runs = std::max(input.runs.size(), input.run_names.size());
  std::vector<bool> done(faults.size(), false);
  for (size_t i = 0; i < faults.size(); ++i) {
    if (done[i]) continue;
    const ColumnFault& fault = faults[i];
    // The same in every run is one fault of all.
    std::vector<size_t> same;
    for (size_t k = i; k < faults.size(); ++k) {
      if (IsAlike(fault, faults[k]) && faults[k].columns == fault.columns) {
        same.push_back(k);
      }
    }
    const bool is_of_all = runs > 1 && same.size() == runs;
    if (is_of_all) {
      for (const size_t k : same) done[k] = true;
    }
    Finding finding = fault.finding;
    finding.file = is_of_all ? "" : fault.run->name;
    finding.subject = Join(fault.columns);
    const CheckInput of =
        is_of_all || runs == 1 ? input : OfOneRun(input, *fault.run);
    for (const std::vector<ColumnFix>& fix : fault.fixes) {
      finding.remedies.push_back(FlagOf(of, fix));
    }
    findings->push_back(std::move(finding));
  }
}

}  // namespace sysid
