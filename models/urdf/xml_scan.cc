#include "models/urdf/xml_scan.h"

#include <cctype>
#include <charconv>
#include <cstdint>
#include <string_view>
#include <system_error>
#include <vector>

#include "models/error.h"
#include "models/printable.h"

namespace sysid {
namespace {

constexpr size_t kMaxDepth = 100;
constexpr char kNoRobot[] = "a URDF is XML with <robot> as its root element";

bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

bool EndsName(char c) {
  return IsSpace(c) || c == '/' || c == '>' || c == '=' || c == '<' ||
         c == '"' || c == '\'';
}

class Scanner {
 public:
  Scanner(const std::string& text, const std::string& path)
      : text_(text), path_(path) {}

  void Run() {
    for (size_t i = 0; i < text_.size(); ++i) {
      if (text_[i] == '\0') Fail(i, "a NUL byte", "save it as text in UTF-8");
      if (static_cast<unsigned char>(text_[i]) < ' ' && !IsSpace(text_[i])) {
        Fail(i, "a control character", "leave it out");
      }
    }
    if (At("\xEF\xBB\xBF")) pos_ = 3;  // byte-order mark
    while (pos_ < text_.size()) {
      if (text_[pos_] == '<') {
        Markup();
        CheckText();
      } else {
        if (open_.empty() && !IsSpace(text_[pos_])) {
          Fail(pos_, "text outside of an element", kNoRobot);
        }
        if (text_[pos_] == '&') CheckReference(pos_);
        ++pos_;
      }
    }
    if (!open_.empty()) {
      Fail(text_.size(), "the file ends inside of " + Called(open_.back()),
           "close it by </" + open_.back().name + ">");
    }
  }

 private:
  struct Element {
    std::string name;
    size_t begin;
  };

  // TinyXML would take the tag that follows for a part of a letter.
  void CheckText() const {
    const size_t end = std::min(text_.find('<', pos_), text_.size());
    if (!IsUtf8(std::string_view(text_).substr(pos_, end - pos_))) {
      Fail(pos_, "text that is not UTF-8", "save it as text in UTF-8");
    }
  }

  bool At(const std::string& what) const {
    return text_.compare(pos_, what.size(), what) == 0;
  }

  size_t Line(size_t pos) const {
    size_t line = 1;
    for (size_t i = 0; i < pos; ++i) line += text_[i] == '\n';
    return line;
  }

  std::string Called(const Element& element) const {
    return "<" + element.name + "> (line " +
           std::to_string(Line(element.begin)) + ")";
  }

  [[noreturn]] void Fail(size_t pos, const std::string& what,
                         const std::string& hint) const {
    const size_t newline = pos == 0 ? text_.npos : text_.rfind('\n', pos - 1);
    const size_t column = newline == text_.npos ? pos + 1 : pos - newline;
    throw InputError(
        path_ + ":" + std::to_string(Line(pos)) + ":" + std::to_string(column),
        "not XML: " + what, hint);
  }

  // Past `end`, or a fault at where the thing began.
  void SkipPast(const std::string& end, const std::string& what) {
    const size_t found = text_.find(end, pos_);
    if (found == text_.npos) {
      Fail(pos_, what + " is not closed", "it ends with " + end);
    }
    pos_ = found + end.size();
  }

  void Markup() {
    if (At("<!--")) return SkipPast("-->", "the comment");
    if (At("<?")) return SkipPast("?>", "the declaration");
    if (At("<![CDATA[")) return SkipPast("]]>", "the CDATA section");
    if (At("<!")) {
      Fail(pos_, "a document type declaration", "leave it out");
    }
    if (At("</")) return EndTag();
    StartTag();
  }

  std::string Name() {
    const size_t begin = pos_;
    while (pos_ < text_.size() && !EndsName(text_[pos_])) ++pos_;
    return text_.substr(begin, pos_ - begin);
  }

  void SkipSpace() {
    while (pos_ < text_.size() && IsSpace(text_[pos_])) ++pos_;
  }

  void EndTag() {
    const size_t begin = pos_;
    pos_ += 2;
    const std::string name = Name();
    SkipSpace();
    if (pos_ >= text_.size() || text_[pos_] != '>') {
      Fail(begin, "the end tag </" + name + " is not closed by >", "");
    }
    ++pos_;
    if (open_.empty()) {
      Fail(begin, "</" + name + "> closes nothing", "");
    }
    if (open_.back().name != name) {
      Fail(begin, "</" + name + "> where " + Called(open_.back()) + " is open",
           "close it first, by </" + open_.back().name + "> or />");
    }
    open_.pop_back();
  }

  void StartTag() {
    const size_t begin = pos_++;
    const std::string name = Name();
    if (!IsUtf8(name)) {
      Fail(begin, "a name that is not UTF-8", "save it as text in UTF-8");
    }
    if (name.empty() || !(std::isalpha(static_cast<unsigned char>(name[0])) ||
                          name[0] == '_' || (name[0] & 0x80))) {
      Fail(begin, "a < that begins no element", "write it as &lt;");
    }
    while (true) {
      SkipSpace();
      if (pos_ >= text_.size() || text_[pos_] == '<') {
        Fail(begin, "the tag <" + name + " is not closed by >", "");
      }
      if (At("/>")) {
        pos_ += 2;
        return;
      }
      if (text_[pos_] == '>') {
        ++pos_;
        break;
      }
      Attribute(name);
    }
    open_.push_back({name, begin});
    if (open_.size() > kMaxDepth) {
      Fail(begin, "more than 100 elements inside each other", "");
    }
  }

  // A letter by its number, &#233; or &#xE9;, is one that XML allows: TinyXML
  // would make a NUL of &#0; or half of a letter of &#xD800;.
  void CheckReference(size_t begin) const {
    if (text_.compare(begin, 2, "&#") != 0) return;
    const bool hexadecimal = text_.compare(begin, 3, "&#x") == 0;
    const char* digits = text_.data() + begin + (hexadecimal ? 3 : 2);
    const char* end = text_.data() + text_.size();
    std::uint32_t letter = 0;
    const auto [rest, error] =
        std::from_chars(digits, end, letter, hexadecimal ? 16 : 10);
    const bool is_letter = letter == '\t' || letter == '\n' || letter == '\r' ||
                           (letter >= 0x20 && letter <= 0xD7FF) ||
                           (letter >= 0xE000 && letter <= 0xFFFD) ||
                           (letter >= 0x10000 && letter <= 0x10FFFF);
    if (error != std::errc() || rest == end || *rest != ';' || !is_letter) {
      Fail(begin, "a &# that is no letter", "&#233; or &#xE9;, for example");
    }
  }

  void Attribute(const std::string& element) {
    const size_t begin = pos_;
    const std::string name = Name();
    SkipSpace();
    if (name.empty() || pos_ >= text_.size() || text_[pos_] != '=') {
      Fail(begin, "an attribute of <" + element + "> without a value",
           "name=\"value\"");
    }
    ++pos_;
    SkipSpace();
    const char quote = pos_ < text_.size() ? text_[pos_] : '\0';
    if (quote != '"' && quote != '\'') {
      Fail(begin,
           "the value of " + name + " in <" + element + "> is not in quotes",
           "name=\"value\"");
    }
    const size_t end = text_.find(quote, pos_ + 1);
    const size_t tag = text_.find('<', pos_ + 1);
    if (end == text_.npos || tag < end) {
      Fail(
          begin,
          "the value of " + name + " in <" + element + "> has no closing quote",
          "name=\"value\"");
    }
    const std::string_view value =
        std::string_view(text_).substr(pos_, end - pos_);
    for (size_t i = 0; i < value.size(); ++i) {
      if (value[i] == '&') CheckReference(pos_ + i);
    }
    // TinyXML would take what follows for a part of a letter.
    if (!IsUtf8(value)) {
      Fail(begin, "the value of " + name + " in <" + element + "> is not UTF-8",
           "save it as text in UTF-8");
    }
    pos_ = end + 1;
  }

  const std::string& text_;
  const std::string& path_;
  size_t pos_ = 0;
  std::vector<Element> open_;
};

}  // namespace

void CheckWellFormed(const std::string& text, const std::string& path) {
  Scanner(text, path).Run();
}

}  // namespace sysid
