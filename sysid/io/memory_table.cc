#include "sysid/io/memory_table.h"

#include <cmath>
#include <set>
#include <utility>

#include "models/error.h"

namespace sysid {

MemoryTable::MemoryTable(const std::string& name, size_t rows,
                         std::vector<Column> columns)
    : TableFile(name), rows_(rows), columns_(std::move(columns)) {
  std::set<std::string> names;
  for (const Column& column : columns_) {
    if (!names.insert(column.name).second) {
      throw InputError(name, "has two columns '" + column.name + "'",
                       "leave one of them out");
    }
    header_.push_back(column.name);
  }
}

std::string MemoryTable::HeaderPlace(int column) const {
  return path_ + ", " + header_[column];
}

std::string MemoryTable::Place(int row, int column) const {
  return HeaderPlace(column) + "[" + std::to_string(row) + "]";
}

std::string MemoryTable::RowName(int row) const {
  return "row " + std::to_string(row);
}

void MemoryTable::ReadRows(const std::vector<int>& wanted, const Visit& visit) {
  std::vector<double> cells(wanted.size());
  for (size_t row = 0; row < rows_; ++row) {
    for (size_t i = 0; i < wanted.size(); ++i) {
      const Column& column = columns_[wanted[i]];
      cells[i] =
          column.values[static_cast<std::ptrdiff_t>(row) * column.stride];
      if (std::isinf(cells[i])) {
        throw InputError(Place(static_cast<int>(row), wanted[i]), "is infinite",
                         "a missing measurement is nan");
      }
    }
    visit(cells);
  }
}

}  // namespace sysid
