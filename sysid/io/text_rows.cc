#include "sysid/io/text_rows.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "models/error.h"
#include "sysid/io/cell.h"

namespace sysid {

std::string SeparatorName(char separator) {
  return separator == ','   ? "comma"
         : separator == ';' ? "semicolon"
         : separator == ' ' ? "space"
                            : "tab";
}

TextRows::TextRows(ByteSource source) : source_(std::move(source)) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  CheckNotUtf16(&source_);
  buffer_.reserve(4 * kMaxLine + kBlock);  // to grow would copy it
  Fill();
  if (buffer_.starts_with(kByteOrderMark)) at_ = kByteOrderMark.size();
}

// Makes sure that a whole line lies in the buffer, or more than kMaxLine of it.
void TextRows::Fill() {
  if (all_read_ || buffer_.size() - at_ > 2 * kMaxLine) return;
  buffer_.erase(0, at_);
  at_ = 0;
  while (!all_read_ && buffer_.size() < 4 * kMaxLine) {
    const size_t size = buffer_.size();
    buffer_.resize(size + kBlock);
    const size_t got = source_.Read(buffer_.data() + size, kBlock);
    buffer_.resize(size + got);
    all_read_ = got == 0;
    if (std::memchr(buffer_.data() + size, 0, got)) {
      throw InputError(source_.path(),
                       "is not a text file: it holds a NUL byte",
                       "save it as text in UTF-8");
    }
  }
}

std::string_view TextRows::Ahead() {
  Fill();
  return std::string_view(buffer_).substr(at_);
}

bool TextRows::AtEnd() {
  Fill();
  return Exhausted();
}

std::string_view TextRows::RowText() const {
  const size_t end = buffer_.find_first_of("\r\n", line_begin_);
  return std::string_view(buffer_).substr(line_begin_, end - line_begin_);
}

void TextRows::BeginLine() {
  Fill();
  line_begin_ = at_;
}

void TextRows::CheckLength() const {
  if (at_ - line_begin_ <= kMaxLine) return;
  throw InputError(source_.path() + ":" + std::to_string(line_) + ":1",
                   "a line of more than 1 MiB",
                   "this is not a separated text with one row a line");
}

void TextRows::SkipEmptyLines(std::string* comment) {
  for (BeginLine(); !Exhausted(); BeginLine()) {
    if (buffer_[at_] == '#') {
      while (!Exhausted() && !AtLineEnd()) ++at_;
      CheckLength();
      if (comment != nullptr) {
        *comment = std::string(Trim(std::string_view(buffer_).substr(
            line_begin_ + 1, at_ - line_begin_ - 1)));
      }
    } else {
      while (!Exhausted() && (buffer_[at_] == ' ' || buffer_[at_] == '\t')) {
        ++at_;
      }
      CheckLength();
      if (!Exhausted() && !AtLineEnd()) {
        at_ = line_begin_;
        return;
      }
    }
    EndLine();
  }
}

std::vector<std::string> TextRows::ReadCells() {
  std::vector<std::string> cells;
  ReadRow([&](int, std::string_view cell) { cells.emplace_back(cell); });
  return cells;
}

std::vector<std::string> TextRows::NextCells() {
  const std::string_view ahead = Ahead();
  if (ahead.empty() || ahead.find_first_of("\r\n") == 0) return {};
  const std::string_view line = ahead.substr(0, ahead.find_first_of("\r\n"));
  TextRows row(ByteSource(source_.path(), std::string(line)));
  row.set_separator(separator_);
  try {
    return row.ReadCells();
  } catch (const InputError&) {
    return {};
  }
}

void TextRows::EndLine() {
  if (Exhausted()) return;
  if (buffer_[at_] == '\r' && at_ + 1 < buffer_.size() &&
      buffer_[at_ + 1] == '\n') {
    ++at_;
  }
  ++at_;
  ++line_;
}

// Behind a cell: to the next one of the row, or past its end.
bool TextRows::NextCell() {
  while (!Exhausted() && IsBlank(buffer_[at_])) ++at_;
  CheckLength();
  if (Exhausted() || AtLineEnd()) {
    EndLine();
    return false;
  }
  // Between cells separated by spaces nothing else stands.
  if (separator_ != ' ') ++at_;
  return true;
}

std::string_view TextRows::ReadCell(int field) {
  while (!Exhausted() && IsBlank(buffer_[at_])) ++at_;
  if (!Exhausted() && buffer_[at_] == '"') return ReadQuoted(field);
  const size_t begin = at_;
  while (!Exhausted() && !AtCellEnd()) ++at_;
  CheckLength();
  return Trim(std::string_view(buffer_).substr(begin, at_ - begin));
}

std::string_view TextRows::ReadQuoted(int field) {
  const int first_line = line_;
  scratch_.clear();
  for (++at_; !Exhausted(); ++at_) {
    const char c = buffer_[at_];
    if (c == '"') {
      if (at_ + 1 >= buffer_.size() || buffer_[at_ + 1] != '"') break;
      ++at_;
    }
    if (c == '\n') ++line_;
    if (at_ - line_begin_ > kMaxLine) break;
    scratch_ += c;
  }
  if (Exhausted() || buffer_[at_] != '"') {
    if (!Exhausted() && line_ == first_line) CheckLength();
    throw InputError(source_.path() + ":" + std::to_string(first_line) + ":" +
                         std::to_string(field + 1),
                     "a quotation mark that is not closed: \"" +
                         std::string(Trim(std::string_view(scratch_).substr(
                             0, std::min<size_t>(scratch_.find('\n'), 20)))),
                     "close it, or drop the quotation marks");
  }
  ++at_;
  // What stands between the closing quote and the separator belongs to the
  // cell: to refuse it is the number's affair.
  while (!Exhausted() && !AtCellEnd()) scratch_ += buffer_[at_++];
  return Trim(scratch_);
}

}  // namespace sysid
