#include "sysid/io/csv.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "models/error.h"
#include "sysid/io/timestamp.h"

namespace sysid {
namespace {

// Each is looked up among all others: names that come twice, near names.
constexpr size_t kMostColumns = 10000;

// Whatever separates its cells.
bool HoldsNumber(std::string_view line) {
  constexpr std::string_view kBetween = ",;\t \"";
  for (size_t begin = 0; begin < line.size();) {
    const size_t end =
        std::min(line.find_first_of(kBetween, begin), line.size());
    double number;
    if (ParseNumber(line.substr(begin, end - begin), &number)) return true;
    begin = end + 1;
  }
  return false;
}

// What begins a comment elsewhere, "" if nothing does.
std::string ForeignComment(std::string_view line) {
  for (const char* mark : {"%", "//"}) {
    if (Trim(line).starts_with(mark)) return mark;
  }
  return "";
}

std::string CommentHint(const std::string& mark) {
  return "if this line is a comment, begin it with '#', not " + Shown(mark);
}

}  // namespace

CsvFile::CsvFile(const std::string& path) : CsvFile(ByteSource(path)) {}

CsvFile::CsvFile(const std::string& path, std::string text)
    : CsvFile(ByteSource(path, std::move(text))) {}

CsvFile::CsvFile(ByteSource source)
    : TableFile(source.path()), rows_(std::move(source)) {
  layout_ = ReadTextLayout(path_, &rows_);
  header_ = layout_.header;
  notices_ = layout_.notices;
  no_header_ = layout_.no_header;
  units_ = layout_.units;
  // numpy.savetxt writes its header as a comment.
  TextRows words(ByteSource(path_, layout_.last_comment));
  words.set_separator(rows_.separator());
  if (!no_header_.empty() && header_.size() > 1 &&
      words.NextCells().size() == header_.size()) {
    no_header_ += "; the comment " + Shown(layout_.last_comment) +
                  " reads like the header: take its '#' away";
  }
  if (header_.size() > kMostColumns) {
    throw InputError(
        HeaderPlace(static_cast<int>(kMostColumns)),
        std::to_string(header_.size()) + " columns; 10000 are the most",
        "is this a run, with a row a sample? Keep the columns that are used");
  }
  for (size_t i = 0; i < header_.size(); ++i) {
    const auto first = std::find(header_.begin(), header_.end(), header_[i]);
    const int at = static_cast<int>(first - header_.begin());
    if (header_[i].empty() || at == static_cast<int>(i)) continue;
    throw InputError(HeaderPlace(static_cast<int>(i)),
                     "column " + Shown(header_[i]) +
                         " appears twice: it is field " +
                         std::to_string(at + 1) + " too",
                     "rename or remove one of them");
  }
}

void CsvFile::CheckHeader() {
  const std::string mark = ForeignComment(header_[0]);
  if (!mark.empty()) {
    rows_.SkipEmptyLines(nullptr);
    std::string_view next = rows_.Ahead();
    next = next.substr(0, next.find_first_of("\r\n"));
    if (!ForeignComment(next).empty() ||
        (!next.empty() && !HoldsNumber(next))) {
      throw InputError(
          HeaderPlace(0),
          "this line begins with " + Shown(mark) + ", and is no header",
          CommentHint(mark));
    }
  }
}

std::string CsvFile::LinePlace(int line, int column) const {
  return path_ + ":" + std::to_string(line) + ":" + std::to_string(column + 1);
}

std::string CsvFile::HeaderPlace(int column) const {
  return LinePlace(layout_.header_line, column);
}

std::string CsvFile::Place(int row, int column) const {
  // A time that is made from the row's number stands nowhere.
  return LinePlace(lines_.Line(row), column < layout_.width() ? column : 0);
}

std::string CsvFile::RowName(int row) const {
  return "line " + std::to_string(lines_.Line(row));
}

double CsvFile::ReadNumber(std::string_view cell, int field) {
  if (cell.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto fail = [&](const std::string& what, const std::string& hint) {
    throw InputError(LinePlace(rows_.row_line(), field),
                     Shown(cell) + " in column " + Shown(header_[field]) + what,
                     hint);
  };
  double value;
  if (ParseNumber(cell, &value)) {
    if (std::isinf(value)) {
      fail(" is not finite", "leave the cell empty where nothing was measured");
    }
    if (rows_.separator() != ',' && cell.find('.') != std::string_view::npos) {
      if (decimal_ == Decimal::kComma) {
        fail(" has a decimal point, but numbers before it decimal commas",
             "write one of them throughout");
      }
      decimal_ = Decimal::kPoint;
    }
    return value;
  }
  if (ParseTimestamp(cell, &value)) {
    if (!has_dates_) {
      notices_.push_back(Shown(header_[field]) +
                         " holds dates: read in seconds");
    }
    has_dates_ = true;
    return value;
  }
  if (rows_.separator() == ',' || !ParseDecimalComma(cell, &value)) {
    const std::string mark = ForeignComment(rows_.RowText());
    if (!mark.empty()) fail(" is not a number", CommentHint(mark));
    if (lines_.rows() == 0 && layout_.width_hint.empty() &&
        !HoldsNumber(rows_.RowText())) {
      fail(" is not a number, nor is any cell of this row: are they units?",
           "delete line " + std::to_string(rows_.row_line()) +
               "; what is not in SI is mapped by --columns joint1.q=column*" +
               "factor");
    }
    fail(" is not a number",
         !layout_.width_hint.empty()
             ? layout_.width_hint
             : "a number looks like -1.5e-3; leave the cell empty where "
               "nothing was measured");
  }
  if (decimal_ == Decimal::kPoint) {
    fail(" has a decimal comma, but numbers before it decimal points",
         "write one of them throughout, and no commas between thousands");
  }
  if (std::isinf(value)) {
    fail(" is not finite", "leave the cell empty where nothing was measured");
  }
  if (decimal_ == Decimal::kUnknown) {
    notices_.push_back("the numbers have decimal commas");
  }
  decimal_ = Decimal::kComma;
  return value;
}

void CsvFile::CheckWidth(int cells) const {
  const int width = layout_.width();
  if (cells == width) return;
  std::string hint = layout_.width_hint;
  const std::string mark = ForeignComment(rows_.RowText());
  if (!mark.empty()) {
    hint = CommentHint(mark);
  } else if (!hint.empty()) {
    // The layout knows better.
  } else if (cells < width) {
    hint = "the row ends before column " + Shown(header_[cells]) +
           "; is the file cut off?";
  } else if (rows_.separator() == ' ') {
    hint = "is there a text with spaces in it? Put it in quotation marks";
  } else {
    hint = "is there a " + SeparatorName(rows_.separator()) + " too many" +
           (rows_.separator() == ',' ? ", or a decimal comma?" : "?");
  }
  throw InputError(LinePlace(rows_.row_line(), std::min(cells, width)),
                   CountOf(cells, "cell") + ", but the header has " +
                       CountOf(width, "column"),
                   hint);
}

void CsvFile::CheckFixed(int field, std::string_view cell) const {
  for (const auto& [column, text] : layout_.fixed_texts) {
    if (static_cast<int>(column) != field || cell == text) continue;
    throw InputError(
        LinePlace(rows_.row_line(), field),
        Shown(cell) + " here, but " + Shown(text) + " in the first row",
        layout_.width_hint);
  }
}

// Of a row, where no column is it.
double CsvFile::TimeOf(const std::vector<double>& numbers) const {
  if (layout_.rate_hz <= 0.0) return numbers[0] + 1e-9 * numbers[1];
  return (layout_.frame_column >= 0 ? numbers[layout_.frame_column]
                                    : lines_.rows()) /
         layout_.rate_hz;
}

void CsvFile::NoteMissing(const std::vector<int>& missing) {
  std::vector<std::string> markers;
  for (size_t i = 0; i < missing.size(); ++i) {
    if (missing[i] == 0) continue;
    const std::string& x = header_[layout_.zero_is_missing[i]];
    markers.push_back(x.substr(0, x.size() - 2) + " (" +
                      std::to_string(missing[i]) + " of " +
                      CountOf(lines_.rows(), "row") + ")");
  }
  if (markers.empty()) return;
  notices_.push_back(
      "a marker at exactly 0, 0, 0 was not seen, and is taken "
      "as missing: " +
      Join(markers));
}

void CsvFile::ReadRows(const std::vector<int>& wanted, const Visit& visit) {
  const int width = layout_.width();
  // By field: whether its number is read.
  std::vector<char> is_read(width, 0);
  for (const int column : wanted) {
    if (column < width) {
      is_read[column] = 1;
    } else if (layout_.frame_column >= 0) {
      is_read[layout_.frame_column] = 1;
    } else if (layout_.rate_hz <= 0.0) {
      is_read[0] = is_read[1] = 1;
    }
  }
  for (const int x : layout_.zero_is_missing) {
    const bool any = is_read[x] || is_read[x + 1] || is_read[x + 2];
    if (any) is_read[x] = is_read[x + 1] = is_read[x + 2] = 1;
  }
  std::vector<double> numbers(header_.size(),
                              std::numeric_limits<double>::quiet_NaN());
  std::vector<double> cells(wanted.size());
  std::vector<int> missing(layout_.zero_is_missing.size(), 0);
  for (rows_.SkipEmptyLines(nullptr); !rows_.AtEnd();
       rows_.SkipEmptyLines(nullptr)) {
    int empty_end = 0;  // behind the last cell that is not empty
    int count = rows_.ReadRow([&](int field, std::string_view cell) {
      if (!cell.empty()) empty_end = field + 1;
      CheckFixed(field, cell);
      if (field < width && is_read[field]) {
        numbers[field] = ReadNumber(cell, field);
      }
    });
    // Tabs at a line's end are not seen in an editor.
    if (rows_.separator() == '\t' && count > width) {
      count = std::max(empty_end, width);
    }
    CheckWidth(count);
    if (layout_.makes_time) numbers[width] = TimeOf(numbers);
    for (size_t i = 0; i < missing.size(); ++i) {
      const int x = layout_.zero_is_missing[i];
      if (!is_read[x] || numbers[x] != 0.0 || numbers[x + 1] != 0.0 ||
          numbers[x + 2] != 0.0) {
        continue;
      }
      numbers[x] = numbers[x + 1] = numbers[x + 2] =
          std::numeric_limits<double>::quiet_NaN();
      ++missing[i];
    }
    for (size_t i = 0; i < wanted.size(); ++i) cells[i] = numbers[wanted[i]];
    lines_.Add(rows_.row_line());
    visit(cells);
  }
  NoteMissing(missing);
}

}  // namespace sysid
