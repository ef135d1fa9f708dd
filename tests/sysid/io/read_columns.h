#pragma once

#include <vector>

#include "sysid/io/table_file.h"

namespace sysid {

struct Table {
  std::vector<std::vector<double>> columns;  // as asked for
  int rows() const {
    return columns.empty() ? 0 : static_cast<int>(columns[0].size());
  }
};

// What ReadRows visits, held.
template <typename File>
Table ReadColumns(File&& file, const std::vector<int>& wanted) {
  Table table;
  table.columns.resize(wanted.size());
  file.ReadRows(wanted, [&](std::span<const double> cells) {
    for (size_t i = 0; i < cells.size(); ++i) {
      table.columns[i].push_back(cells[i]);
    }
  });
  return table;
}

}  // namespace sysid
