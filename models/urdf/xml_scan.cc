#include "models/urdf/xml_scan.h"

#include <cctype>
#include <string_view>
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
    if (const size_t nul = text_.find('\0'); nul != text_.npos) {
      Fail(nul, "a NUL byte", "save it as text in UTF-8");
    }
    if (At("\xEF\xBB\xBF")) pos_ = 3;  // byte-order mark
    while (pos_ < text_.size()) {
      if (text_[pos_] == '<') {
        Markup();
      } else {
        if (open_.empty() && !IsSpace(text_[pos_])) {
          Fail(pos_, "text outside of an element", kNoRobot);
        }
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
    // TinyXML would take what follows for a part of a letter.
    if (!IsUtf8(std::string_view(text_).substr(pos_, end - pos_))) {
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
