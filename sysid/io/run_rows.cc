#include "sysid/io/run_rows.h"

#include <algorithm>

#include "sysid/io/cell.h"

namespace sysid {

Run RowsOf(const Run& run, int first, int last) {
  Run rows;
  rows.name = run.name;
  rows.unread = run.unread;
  rows.time_source = run.time_source;
  rows.t.assign(run.t.begin() + first, run.t.begin() + last);
  rows.recorded_efforts = run.recorded_efforts;
  rows.effort = run.effort.middleRows(first, last - first);
  for (const Input& input : run.inputs) {
    rows.inputs.push_back(
        {input.name,
         input.held,
         {input.values.begin() + first, input.values.begin() + last}});
  }
  for (const Channel& channel : run.channels) {
    Channel part = channel;
    part.values = channel.values.middleRows(first, last - first);
    rows.channels.push_back(std::move(part));
  }
  return rows;
}

void BeginMeasured(Run* run, std::vector<std::string>* notices) {
  const auto is_measured = [&](int k) {
    return std::any_of(run->channels.begin(), run->channels.end(),
                       [&](const Channel& channel) {
                         return !channel.values.row(k).array().isNaN().all();
                       });
  };
  int first = 0;
  while (first < run->size() && !is_measured(first)) ++first;
  // Two rows are the least of a run.
  if (first == 0 || first + 2 > run->size()) return;
  *run = RowsOf(*run, first, run->size());
  if (notices == nullptr) return;
  notices->push_back(run->name + ": begins at " + RoundedText(run->t.front()) +
                     " s: nothing before is measured");
}

}  // namespace sysid
