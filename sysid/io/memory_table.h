#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "sysid/io/table_file.h"

namespace sysid {

// A recording in memory as a file's reader gives it: named columns of numbers,
// NaN where a measurement is missing.
class MemoryTable : public TableFile {
 public:
  // Numbers that lie `stride` numbers apart, which must outlive the table.
  struct Column {
    std::string name;
    const double* values = nullptr;
    std::ptrdiff_t stride = 1;
  };

  // `name` is the recording's, in errors and reports. Throws InputError for two
  // columns of one name.
  MemoryTable(const std::string& name, size_t rows,
              std::vector<Column> columns);

  // "run 1, joint1.q"; "run 1, joint1.q[12]": rows count from 0 as in the
  // languages that have such arrays.
  std::string HeaderPlace(int column) const override;
  std::string Place(int row, int column) const override;
  std::string RowName(int row) const override;
  // Throws InputError for an infinite number.
  void ReadRows(const std::vector<int>& wanted, const Visit& visit) override;

 private:
  size_t rows_;
  std::vector<Column> columns_;
};

}  // namespace sysid
