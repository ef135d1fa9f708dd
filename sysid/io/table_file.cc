#include "sysid/io/table_file.h"

#include <algorithm>

namespace sysid {

TableFile::Table TableFile::ReadColumns(const std::vector<int>& wanted) {
  Table table;
  table.columns.resize(wanted.size());
  ReadRows(wanted, [&](std::span<const double> cells) {
    for (size_t i = 0; i < cells.size(); ++i) {
      table.columns[i].push_back(cells[i]);
    }
  });
  return table;
}

}  // namespace sysid
