#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sysid/io/byte_source.h"

namespace sysid {

// "comma", of what separates cells.
std::string SeparatorName(char separator);

// Walks through a separated text line by line and cell by cell (RFC 4180: cells
// may be quoted; also CRLF, CR, a byte order mark, blank lines, and comment
// lines that begin with '#'). Holds a few MiB of it, whatever its size.
//
// Throws InputError for UTF-16, a NUL byte, a line of more than 1 MiB and a
// quotation mark that is not closed.
class TextRows {
 public:
  explicit TextRows(ByteSource source);

  // ',', ';', '\t', or ' ' for runs of spaces and tabs.
  void set_separator(char separator) { separator_ = separator; }
  char separator() const { return separator_; }

  // What comes next, at least a line (and 1 MiB, where there is as much).
  std::string_view Ahead();
  bool AtEnd();

  // Skips lines without a cell: blank ones and comments. `comment` (may be
  // null) receives the last comment.
  void SkipEmptyLines(std::string* comment);

  // Calls visit(i, cell) for each cell of the line at the cursor and returns
  // their number. A cell is valid until the next one is read.
  template <typename Visit>
  int ReadRow(Visit&& visit) {
    BeginLine();
    row_line_ = line_;
    for (int i = 0;; ++i) {
      visit(i, ReadCell(i));
      if (!NextCell()) return i + 1;
    }
  }
  // The cells of the next row, copied.
  std::vector<std::string> ReadCells();
  // The same of the line at the cursor, which stays to be read; none at the end
  // and where a quotation mark is not closed in it.
  std::vector<std::string> NextCells();
  // The line, from 1, where the row that was read last begins.
  int row_line() const { return row_line_; }
  // That line as it stands, until the next row is read.
  std::string_view RowText() const;
  // The line at the cursor.
  int line() const { return line_; }

 private:
  static constexpr size_t kMaxLine = size_t{1} << 20;
  static constexpr size_t kBlock = size_t{1} << 16;  // read at once

  bool IsBlank(char c) const {
    return c == ' ' || (c == '\t' && separator_ != '\t');
  }
  // All that is left is in the buffer, and that is nothing.
  bool Exhausted() const { return at_ >= buffer_.size(); }
  bool AtLineEnd() const {
    return buffer_[at_] == '\n' || buffer_[at_] == '\r';
  }
  bool AtCellEnd() const {
    return (separator_ == ' ' ? IsBlank(buffer_[at_])
                              : buffer_[at_] == separator_) ||
           AtLineEnd();
  }
  void Fill();
  void BeginLine();
  void EndLine();
  bool NextCell();
  void CheckLength() const;
  std::string_view ReadCell(int field);
  std::string_view ReadQuoted(int field);

  ByteSource source_;
  std::string buffer_;
  size_t at_ = 0;          // in the buffer
  size_t line_begin_ = 0;  // of the row that is read
  bool all_read_ = false;
  int line_ = 1;
  int row_line_ = 0;
  char separator_ = ',';
  std::string scratch_;
};

}  // namespace sysid
