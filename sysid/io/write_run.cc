#include "sysid/io/write_run.h"

#include <cmath>

#include "sysid/io/csv.h"
#include "sysid/io/run_columns.h"

namespace sysid {
namespace {

// Where a column's numbers are.
struct Source {
  const RowMatrixXd* values;
  int slot;
};

void AddSources(const Mechanism& mechanism, const Run& run, std::string* header,
                std::vector<Source>* sources) {
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
      *header += ',';
      *header += CsvCell(group.columns[i]);
      sources->push_back({values, first + group.slots[i]});
    }
  }
}

}  // namespace

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
  std::vector<Source> sources;
  AddSources(mechanism, run, &header, &sources);
  for (const Input& input : run.inputs) header += ',' + CsvCell(input.name);
  text += header + "\n";
  for (int row = 0; row < run.size(); ++row) {
    text += ShortestText(run.t[row]);
    for (const Source& source : sources) {
      const double value = (*source.values)(row, source.slot);
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
