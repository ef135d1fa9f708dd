#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace sysid {

// A comma-separated text with a header (RFC 4180: cells may be quoted; also
// CRLF, a UTF-8 byte order mark, blank lines, and comment lines that begin with
// '#'). Knows nothing of what the columns mean.
//
// Places in errors are "run.csv:LINE:FIELD", both counted from 1; the texts
// name the column too.
class CsvFile {
 public:
  // Reads the file and its header. Throws InputError for a file that is
  // missing, a folder, unreadable, empty, binary (it holds a NUL byte), for a
  // line of more than 1 MiB, for more than 10000 columns and for a column name
  // that appears twice.
  explicit CsvFile(const std::string& path);
  // The same from text; `path` only names it in errors.
  CsvFile(const std::string& path, std::string text);

  const std::string& path() const { return path_; }
  // Spaces around names are dropped. Names may be empty.
  const std::vector<std::string>& header() const { return header_; }
  int header_line() const { return header_line_; }
  // Whether each cell of the first row reads as a number: there is no header.
  bool HeaderIsNumbers() const;
  // The last comment line before the header, without '#'; "" if there is none.
  const std::string& last_comment() const { return last_comment_; }

  // "run.csv:12:3"; `column` is an index into the header.
  std::string Place(int line, int column) const;
  std::string HeaderPlace(int column) const;

  struct Table {
    std::vector<int> lines;                    // of each row
    std::vector<std::vector<double>> columns;  // as asked for; NaN is missing
    int rows() const { return static_cast<int>(lines.size()); }
  };
  // The numbers of these columns (indices into the header); the others are only
  // counted, and may hold text. An empty cell or "nan" is NaN. Throws
  // InputError for a row with another number of cells than the header, text in
  // a number, an infinite or too large number, a quote that is not closed and a
  // line of more than 1 MiB.
  Table ReadColumns(const std::vector<int>& wanted) const;

 private:
  void ReadHeader();

  std::string path_;
  std::string text_;
  std::vector<std::string> header_;
  std::string last_comment_;
  int header_line_ = 0;
  size_t data_begin_ = 0;  // offset of the line after the header
  int data_line_ = 0;      // its number
};

// A cell or name as an error shows it: in quotes, at most 40 characters, what
// cannot be printed as '?'.
std::string Shown(std::string_view text);

// The whole text as a number: true and the value, else false. "nan" and "inf"
// are numbers here. A leading '+' and spaces around are fine.
bool ParseNumber(std::string_view text, double* value);

std::string_view Trim(std::string_view text);

// The shortest text that reads back as the same number.
std::string ShortestText(double value);

// A cell as RFC 4180 writes it: quoted where it must be.
std::string CsvCell(const std::string& text);

}  // namespace sysid
