#include "sysid/io/csv.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "models/error.h"
#include "sysid/io/read_file.h"

namespace sysid {
namespace {

constexpr size_t kMaxLine = size_t{1} << 20;
// Each is looked up among all others: names that come twice, near names.
constexpr size_t kMostColumns = 10000;

bool IsSpace(char c) { return c == ' ' || c == '\t'; }

// Walks through a text line by line and cell by cell.
class Cursor {
 public:
  Cursor(const std::string& path, std::string_view text, size_t at, int line)
      : path_(path), text_(text), at_(at), line_(line) {}

  bool AtEnd() const { return at_ >= text_.size(); }
  size_t at() const { return at_; }
  int line() const { return line_; }

  // Skips lines without a cell: blank ones and comments. `comment` (may be
  // null) receives the last comment.
  void SkipEmptyLines(std::string* comment) {
    for (line_begin_ = at_; !AtEnd(); line_begin_ = at_) {
      if (text_[at_] == '#') {
        while (!AtEnd() && !AtLineEnd()) ++at_;
        if (comment != nullptr) {
          *comment = std::string(
              Trim(text_.substr(line_begin_ + 1, at_ - line_begin_ - 1)));
        }
      } else {
        while (!AtEnd() && IsSpace(text_[at_])) ++at_;
        if (!AtEnd() && !AtLineEnd()) {
          at_ = line_begin_;
          return;
        }
      }
      EndLine();
    }
  }

  // Calls visit(i, cell) for each cell of the line at the cursor and returns
  // their number. A cell is valid until the next one is read.
  template <typename Visit>
  int ReadRow(Visit&& visit) {
    row_line_ = line_;
    for (int i = 0;; ++i) {
      const std::string_view cell = ReadCell(i);
      visit(i, cell);
      if (AtEnd() || text_[at_] != ',') {
        EndLine();
        return i + 1;
      }
      ++at_;
    }
  }
  int row_line() const { return row_line_; }

 private:
  bool AtLineEnd() const { return text_[at_] == '\n' || text_[at_] == '\r'; }
  bool AtCellEnd() const { return text_[at_] == ',' || AtLineEnd(); }

  [[noreturn]] void ThrowLongLine() const {
    throw InputError(path_ + ":" + std::to_string(line_) + ":1",
                     "a line of more than 1 MiB",
                     "this is not a comma-separated text with one row a line");
  }

  void EndLine() {
    if (AtEnd()) return;
    if (text_[at_] == '\r' && at_ + 1 < text_.size() && text_[at_ + 1] == '\n')
      ++at_;
    ++at_;
    ++line_;
  }

  std::string_view ReadCell(int field) {
    while (!AtEnd() && IsSpace(text_[at_])) ++at_;
    if (!AtEnd() && text_[at_] == '"') return ReadQuoted(field);
    const size_t begin = at_;
    while (!AtEnd() && !AtCellEnd()) ++at_;
    if (at_ - line_begin_ > kMaxLine) ThrowLongLine();
    return Trim(text_.substr(begin, at_ - begin));
  }

  std::string_view ReadQuoted(int field) {
    const int first_line = line_;
    scratch_.clear();
    for (++at_; !AtEnd(); ++at_) {
      const char c = text_[at_];
      if (c == '"') {
        if (at_ + 1 >= text_.size() || text_[at_ + 1] != '"') break;
        ++at_;
      }
      if (c == '\n') ++line_;
      if (at_ - line_begin_ > kMaxLine) break;
      scratch_ += c;
    }
    if (AtEnd() || text_[at_] != '"') {
      if (!AtEnd() && line_ == first_line) ThrowLongLine();
      throw InputError(path_ + ":" + std::to_string(first_line) + ":" +
                           std::to_string(field + 1),
                       "a quotation mark that is not closed: \"" +
                           std::string(Trim(std::string_view(scratch_).substr(
                               0, std::min<size_t>(scratch_.find('\n'), 20)))),
                       "close it, or drop the quotation marks");
    }
    ++at_;
    // What stands between the closing quote and the comma belongs to the cell:
    // to refuse it is the number's affair.
    while (!AtEnd() && !AtCellEnd()) scratch_ += text_[at_++];
    return Trim(scratch_);
  }

  const std::string& path_;
  std::string_view text_;
  size_t at_;
  size_t line_begin_ = 0;
  int line_;
  int row_line_ = 0;
  std::string scratch_;
};

std::string CountOf(int n, const std::string& noun) {
  return std::to_string(n) + " " + noun + (n == 1 ? "" : "s");
}

}  // namespace

std::string_view Trim(std::string_view text) {
  while (!text.empty() && IsSpace(text.front())) text.remove_prefix(1);
  while (!text.empty() && IsSpace(text.back())) text.remove_suffix(1);
  return text;
}

bool ParseNumber(std::string_view text, double* value) {
  text = Trim(text);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-' && text[1] != '+') {
    text.remove_prefix(1);
  }
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, *value);
  if (rest != end || text.empty()) return false;
  if (error == std::errc()) return true;
  if (error != std::errc::result_out_of_range) return false;
  // Too large or too small for a double: 1e999 is infinite, 1e-999 is 0.
  *value = std::strtod(std::string(text).c_str(), nullptr);
  return true;
}

std::string Shown(std::string_view text) {
  constexpr size_t kMost = 40;
  std::string shown = "'";
  for (const char c : text.substr(0, kMost)) {
    // Bytes of UTF-8 are kept whole only as long as the text is not cut.
    const bool printable = static_cast<unsigned char>(c) >= 0x80
                               ? text.size() <= kMost
                               : c >= ' ' && c != 0x7f;
    shown += printable ? c : '?';
  }
  if (text.size() > kMost) shown += "...";
  return shown + "'";
}

std::string ShortestText(double value) {
  char buffer[32];
  const auto result = std::to_chars(buffer, buffer + sizeof(buffer), value);
  return std::string(buffer, result.ptr);
}

std::string CsvCell(const std::string& text) {
  const bool plain = text.find_first_of(",\"\r\n") == std::string::npos &&
                     Trim(text).size() == text.size();
  if (plain) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + "\"";
}

CsvFile::CsvFile(const std::string& path)
    : path_(path), text_(ReadTextFile(path)) {
  ReadHeader();
}

CsvFile::CsvFile(const std::string& path, std::string text)
    : path_(path), text_(std::move(text)) {
  ReadHeader();
}

void CsvFile::ReadHeader() {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  const size_t begin =
      text_.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0;
  Cursor cursor(path_, text_, begin, 1);
  cursor.SkipEmptyLines(&last_comment_);
  if (cursor.AtEnd()) {
    throw InputError(path_ + ":1:1",
                     text_.size() == begin ? "the file is empty"
                                           : "the file has no header and no "
                                             "rows, only comments or blanks",
                     "a run is a header such as t,joint1.q and a row a sample");
  }
  cursor.ReadRow([&](int, std::string_view cell) {
    header_.push_back(std::string(cell));
  });
  header_line_ = cursor.row_line();
  if (header_.size() > kMostColumns) {
    throw InputError(
        HeaderPlace(static_cast<int>(kMostColumns)),
        std::to_string(header_.size()) + " columns; 10000 are the most",
        "is this a run, with a row a sample? Keep the columns that are used");
  }
  data_begin_ = cursor.at();
  data_line_ = cursor.line();
  for (size_t i = 0; i < header_.size(); ++i) {
    const auto first = std::find(header_.begin(), header_.end(), header_[i]);
    const int at = static_cast<int>(first - header_.begin());
    if (header_[i].empty() || at == static_cast<int>(i)) continue;
    double number;
    if (ParseNumber(header_[i], &number)) continue;  // there is no header
    throw InputError(HeaderPlace(static_cast<int>(i)),
                     "column " + Shown(header_[i]) +
                         " appears twice: it is field " +
                         std::to_string(at + 1) + " too",
                     "rename or remove one of them");
  }
}

bool CsvFile::HeaderIsNumbers() const {
  double number;
  return std::all_of(
      header_.begin(), header_.end(),
      [&](const std::string& name) { return ParseNumber(name, &number); });
}

std::string CsvFile::Place(int line, int column) const {
  return path_ + ":" + std::to_string(line) + ":" + std::to_string(column + 1);
}

std::string CsvFile::HeaderPlace(int column) const {
  return Place(header_line_, column);
}

CsvFile::Table CsvFile::ReadColumns(const std::vector<int>& wanted) const {
  const int width = static_cast<int>(header_.size());
  Table table;
  table.columns.resize(wanted.size());
  // By field: where its numbers go.
  std::vector<std::vector<double>*> into(header_.size(), nullptr);
  for (size_t i = 0; i < wanted.size(); ++i) {
    into[wanted[i]] = &table.columns[i];
  }
  Cursor cursor(path_, text_, data_begin_, data_line_);
  for (cursor.SkipEmptyLines(nullptr); !cursor.AtEnd();
       cursor.SkipEmptyLines(nullptr)) {
    const int cells = cursor.ReadRow([&](int field, std::string_view cell) {
      if (field >= width || into[field] == nullptr) return;
      double value = std::numeric_limits<double>::quiet_NaN();
      if (!cell.empty() && !ParseNumber(cell, &value)) {
        throw InputError(
            Place(cursor.row_line(), field),
            Shown(cell) + " in column " + Shown(header_[field]) +
                " is not a number",
            "a number looks like -1.5e-3; leave the cell empty where nothing "
            "was measured");
      }
      if (std::isinf(value)) {
        throw InputError(Place(cursor.row_line(), field),
                         Shown(cell) + " in column " + Shown(header_[field]) +
                             " is not finite",
                         "leave the cell empty where nothing was measured");
      }
      into[field]->push_back(value);
    });
    if (cells != width) {
      throw InputError(
          Place(cursor.row_line(), std::min(cells, width)),
          CountOf(cells, "cell") + ", but the header has " +
              CountOf(width, "column"),
          cells < width ? "the row ends before column " +
                              Shown(header_[cells]) + "; is the file cut off?"
                        : "is there a comma too many, or a decimal comma?");
    }
    table.lines.push_back(cursor.row_line());
  }
  // A column that was asked for twice was filled in its last place.
  for (size_t i = 0; i < wanted.size(); ++i) {
    if (into[wanted[i]] != &table.columns[i]) {
      table.columns[i] = *into[wanted[i]];
    }
  }
  return table;
}

}  // namespace sysid
