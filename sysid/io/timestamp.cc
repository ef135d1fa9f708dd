#include "sysid/io/timestamp.h"

#include <chrono>
#include <cmath>
#include <string>

#include "sysid/io/cell.h"

namespace sysid {
namespace {

// Reads front to back; what does not fit ends it.
class Scan {
 public:
  explicit Scan(std::string_view text) : text_(text) {}

  bool ok() const { return ok_; }
  bool AtEnd() const { return text_.empty(); }
  char Next() const { return text_.empty() ? '\0' : text_.front(); }

  // Digits, `least` to `most` of them.
  int Digits(size_t least, size_t most) {
    size_t n = 0;
    int value = 0;
    while (n < most && n < text_.size() && text_[n] >= '0' && text_[n] <= '9') {
      value = 10 * value + (text_[n++] - '0');
    }
    ok_ = ok_ && n >= least;
    text_.remove_prefix(n);
    return value;
  }
  // One of these.
  char Take(std::string_view any) {
    const char c = Next();
    if (c == '\0' || any.find(c) == any.npos) {
      ok_ = false;
      return '\0';
    }
    text_.remove_prefix(1);
    return c;
  }
  // ".005", or nothing.
  double Fraction() {
    if (Next() != '.' && Next() != ',') return 0.0;
    size_t n = 1;
    while (n < text_.size() && text_[n] >= '0' && text_[n] <= '9') ++n;
    double value = 0.0;
    ok_ = ok_ && n > 1 &&
          ParseNumber("0." + std::string(text_.substr(1, n - 1)), &value);
    text_.remove_prefix(n);
    return value;
  }

 private:
  std::string_view text_;
  bool ok_ = true;
};

std::chrono::year_month_day ReadDate(bool day_first, Scan* scan) {
  const int first = day_first ? scan->Digits(1, 2) : scan->Digits(4, 4);
  const char mark = scan->Take(day_first ? "." : "-/");
  const int month = scan->Digits(1, 2);
  if (mark != scan->Take("-/.")) return {};
  const int last = day_first ? scan->Digits(4, 4) : scan->Digits(1, 2);
  return {std::chrono::year(day_first ? last : first),
          std::chrono::month(static_cast<unsigned>(month)),
          std::chrono::day(static_cast<unsigned>(day_first ? first : last))};
}

// "Z", "+02:00", "+0200" or nothing: seconds east.
double ReadZone(Scan* scan) {
  if (scan->Next() == 'Z') {
    scan->Take("Z");
    return 0.0;
  }
  if (scan->Next() != '+' && scan->Next() != '-') return 0.0;
  const double sign = scan->Take("+-") == '-' ? -1.0 : 1.0;
  const int hours = scan->Digits(2, 2);
  if (scan->Next() == ':') scan->Take(":");
  return sign * 60.0 * (60.0 * hours + scan->Digits(2, 2));
}

}  // namespace

bool ParseTimestamp(std::string_view text, double* seconds) {
  text = Trim(text);
  constexpr size_t kShortest = 14;  // "1.5.2024 12:00"
  if (text.size() < kShortest) return false;
  Scan scan(text);
  const auto date = ReadDate(text[1] == '.' || text[2] == '.', &scan);
  if (!scan.ok() || !date.ok()) return false;
  scan.Take("T ");
  const int hour = scan.Digits(1, 2);
  scan.Take(":");
  const int minute = scan.Digits(2, 2);
  double second = 0.0;
  if (scan.Next() == ':') {
    scan.Take(":");
    second = scan.Digits(2, 2);
    second += scan.Fraction();
  }
  const double zone = ReadZone(&scan);
  if (!scan.ok() || !scan.AtEnd() || hour > 23 || minute > 59 ||
      second >= 61.0) {
    return false;
  }
  const auto days = std::chrono::sys_days(date).time_since_epoch().count();
  *seconds = 86400.0 * static_cast<double>(days) + 3600.0 * hour +
             60.0 * minute + second - zone;
  return true;
}

}  // namespace sysid
