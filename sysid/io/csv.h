#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sysid/io/cell.h"
#include "sysid/io/line_numbers.h"
#include "sysid/io/table_file.h"
#include "sysid/io/text_layout.h"
#include "sysid/io/text_rows.h"

namespace sysid {

// A text with a header and a row a line (without a header its columns are "#1",
// "#2", ...; behind it there may be a row of units): separated by commas,
// semicolons, tabs or runs of spaces, the last three with decimal points or
// decimal commas; and what motion-capture systems export (text_layout.h). What
// is not as in docs/interface.md section 2 is said in a notice.
//
// The file is read front to back in blocks, once: pipes are fine. Places in
// errors are "run.csv:LINE:FIELD", both counted from 1; the texts name the
// column too.
class CsvFile : public TableFile {
 public:
  // Reads the header. Throws InputError for a file that is missing, a folder,
  // unreadable, empty, in UTF-16, binary (it holds a NUL byte), for a line of
  // more than 1 MiB, more than 10000 columns, a column name that appears twice
  // and a separator that could be two.
  explicit CsvFile(const std::string& path);
  explicit CsvFile(ByteSource source);
  // The same from text; `path` only names it in errors.
  CsvFile(const std::string& path, std::string text);

  // Throws InputError where the first row is a comment of others.
  void CheckHeader();

  std::string HeaderPlace(int column) const override;
  std::string Place(int row, int column) const override;
  std::string RowName(int row) const override;
  // Throws InputError for a row with another number of cells than the header,
  // text in a number that is no date with a clock (timestamp.h), an infinite or
  // too large number, a number with a decimal comma beside others with points,
  // a quote that is not closed and a line of more than 1 MiB.
  void ReadRows(const std::vector<int>& wanted, const Visit& visit) override;

 private:
  enum class Decimal { kUnknown, kPoint, kComma };

  std::string LinePlace(int line, int column) const;
  double ReadNumber(std::string_view cell, int field);
  void CheckWidth(int cells) const;
  void CheckFixed(int field, std::string_view cell) const;
  double TimeOf(const std::vector<double>& numbers) const;
  void NoteMissing(const std::vector<int>& missing);

  TextRows rows_;
  TextLayout layout_;
  Decimal decimal_ = Decimal::kUnknown;
  bool has_dates_ = false;
  LineNumbers lines_;
};

}  // namespace sysid
