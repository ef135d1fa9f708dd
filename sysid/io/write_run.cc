#include "sysid/io/write_run.h"

#include <cmath>

#include "sysid/io/csv.h"
#include "sysid/io/run_columns.h"

namespace sysid {

std::vector<ColumnOfRun> ColumnsOfRun(const Mechanism& mechanism,
                                      const Run& run) {
  std::vector<ColumnOfRun> columns;
  for (const ColumnGroup& whole : RunColumnGroups(mechanism)) {
    const RowMatrixXd* values = nullptr;
    ColumnGroup group = whole;
    int first = 0;
    if (group.is_effort) {
      first = mechanism.joints[group.target].v_index;
      const int size = static_cast<int>(group.columns.size());
      if (HasEffort(run, first, size)) values = &run.effort;
    } else {
      const Channel* channel = FindChannel(run, group.kind, group.target);
      if (channel != nullptr) {
        values = &channel->values;
        group = AlongAxes(whole, channel->axes);
      }
    }
    if (values == nullptr) continue;
    for (size_t i = 0; i < group.columns.size(); ++i) {
      columns.push_back({group.columns[i], values, first + group.slots[i]});
    }
  }
  return columns;
}

std::string FormatRun(const Mechanism& mechanism, const Run& run,
                      const std::vector<std::string>& comments) {
  std::string text;
  for (const std::string& comment : comments) {
    text += "# ";
    for (const char c : comment) {
      text += c;
      if (c == '\n') text += "# ";  // several lines stay a comment
    }
    text += '\n';
  }
  std::string header = "t";
  const std::vector<ColumnOfRun> columns = ColumnsOfRun(mechanism, run);
  for (const ColumnOfRun& column : columns)
    header += ',' + CsvCell(column.name);
  for (const Input& input : run.inputs) header += ',' + CsvCell(input.name);
  text += header + "\n";
  for (int row = 0; row < run.size(); ++row) {
    text += ShortestText(run.t[row]);
    for (const ColumnOfRun& column : columns) {
      const double value = (*column.values)(row, column.slot);
      text += ',';
      if (std::isfinite(value)) text += ShortestText(value);
    }
    for (const Input& input : run.inputs) {
      text += ',' + ShortestText(input.values[row]);
    }
    text += '\n';
  }
  return text;
}

}  // namespace sysid
