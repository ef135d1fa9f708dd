#include "models/formula/formula.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "models/error.h"
#include "models/formula/derive_units.h"
#include "models/printable.h"

namespace sysid {
namespace {

bool ReadsAsNumber(std::string_view text) {
  double value;
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

// Characters, where bytes are UTF-8.
size_t LettersOf(std::string_view text) {
  return static_cast<size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

// Where the character with this index begins.
size_t PlaceOf(std::string_view text, size_t letter) {
  size_t place = 0;
  for (size_t seen = 0; place < text.size(); ++place) {
    if ((text[place] & 0xC0) != 0x80 && seen++ == letter) break;
  }
  return place;
}

class FormulaParser : private SyntaxParser {
 public:
  FormulaParser(std::string_view text, const std::vector<KnownName>& known,
                Formula* out, FormulaFault* fault)
      : SyntaxParser(text,
                     {.operand = "a name, a number or '('",
                      .operators = "+ - * / ^",
                      .hint = "write a law such as -k*q^3 or -c*tanh(qd/v); "
                              "put odd names in quotes",
                      .zero_hint = "leave the term out"},
                     &out->tree, fault),
        known_(known),
        out_(out) {}

  bool Parse() {
    if (!ParseSum()) return false;
    if (out_->parameters.empty()) {
      Fail(0, "nothing to estimate: " + Shown(text_) + " has no parameter",
           known_.empty() ? "a name is a parameter, such as k in k*2"
                          : "a name that is not known is a parameter, such "
                            "as k in k*" +
                                known_[0].name);
      return false;
    }
    // The parser numbers names in the order in which it meets them.
    std::vector<int> to(uses_.size());
    int next = 0;
    for (const bool of_parameter : {false, true}) {
      for (size_t i = 0; i < uses_.size(); ++i) {
        if ((uses_[i].known < 0) == of_parameter) to[i] = next++;
      }
    }
    out_->tree.Rename(to);
    return true;
  }

 private:
  // A name that the formula uses.
  struct Used {
    int known = -1;         // an index, or
    std::string parameter;  // its name
  };

  // Whether the name at `begin` may end before `end`.
  bool EndsName(size_t end) const {
    if (end == text_.size() || !IsWordLetter(text_[end - 1])) return true;
    const bool member = text_[end] == '.' && end + 1 < text_.size() &&
                        IsWordLetter(text_[end + 1]);
    return !member && !IsWordLetter(text_[end]);
  }

  bool EndsOperand(size_t at) const override {
    return !IsWordLetter(text_[at]) && text_[at] != '.';
  }

  int Name() override {
    int best = -1;
    for (size_t i = 0; i < known_.size(); ++i) {
      const std::string& name = known_[i].name;
      const size_t end = at_ + name.size();
      if (name.empty() || !rest().starts_with(name) || !EndsName(end) ||
          (best >= 0 && name.size() <= known_[best].name.size()) ||
          ReadsAsNumber(name) ||
          (FindFunction(name) != nullptr && IsCalled(end))) {
        continue;
      }
      best = static_cast<int>(i);
    }
    if (best < 0) return kNone;
    at_ += known_[best].name.size();
    return UseOnce({best, ""});
  }

  int QuotedName(size_t at, const std::string& name) override {
    for (size_t i = 0; i < known_.size(); ++i) {
      if (known_[i].name == name) return UseOnce({static_cast<int>(i), ""});
    }
    return FailInput(at, name);
  }

  int Unknown() override {
    const std::string_view word = Word();
    if (word.empty()) return FailStray();
    const size_t end = at_ + word.size();
    const std::string name(word);
    if (word.find('.') != std::string_view::npos) return FailInput(at_, name);
    if (IsCalled(end)) return FailFunction(name);
    if (FindFunction(word) != nullptr) {
      return Fail(
          at_, "'" + name + "' is a function, and has no argument",
          "write " + name + "(...), or give the parameter another name");
    }
    at_ = end;
    return UseOnce({-1, name});
  }

  // Identifiers with dots between them, from the cursor; "" if there is none.
  std::string_view Word() const {
    size_t end = at_ + Identifier().size();
    if (end == at_) return "";
    while (end + 1 < text_.size() && text_[end] == '.' &&
           IsWordLetter(text_[end + 1])) {
      for (++end; end < text_.size() && IsWordLetter(text_[end]); ++end) {
      }
    }
    return text_.substr(at_, end - at_);
  }

  // A number with something at its end, or what is no part of any formula.
  int FailStray() {
    const char c = text_[at_];
    if (!IsDigit(c) && c != '.') {
      return Fail(
          at_, "a name, a number or '(' is expected before " + Shown(rest()));
    }
    double value;
    const char* const begin = text_.data() + at_;
    const auto [end, error] =
        std::from_chars(begin, text_.data() + text_.size(), value);
    if (error == std::errc::result_out_of_range) {
      return Fail(at_, "a number that is too large or too small");
    }
    if (error != std::errc()) {
      return Fail(at_, Shown(rest()) + " is no number");
    }
    return FailOperator(at_ + static_cast<size_t>(end - begin));
  }

  int FailInput(size_t at, const std::string& name) {
    std::vector<std::string> names;
    for (const KnownName& known : known_) names.push_back(known.name);
    return Fail(at, "no input or joint " + Shown(name), NameHint(name, names));
  }

  int FailFunction(const std::string& name) {
    std::vector<std::string> names;
    for (const SyntaxTree::Function& function : SyntaxTree::Functions()) {
      names.emplace_back(function.name);
    }
    const std::string nearest = NearestName(name, names);
    return Fail(
        at_, "no function " + Shown(name),
        nearest.empty()
            ? "write '*' before '(' for a product; functions: " + Join(names)
            : NameHint(name, names));
  }

  int UseOnce(const Used& used) {
    for (size_t i = 0; i < uses_.size(); ++i) {
      if (uses_[i].known == used.known &&
          uses_[i].parameter == used.parameter) {
        return Use(static_cast<int>(i));
      }
    }
    uses_.push_back(used);
    if (used.known >= 0) {
      out_->known.push_back(used.known);
    } else {
      out_->parameters.push_back(used.parameter);
    }
    return Use(static_cast<int>(uses_.size()) - 1);
  }

  const std::vector<KnownName>& known_;
  Formula* out_;
  std::vector<Used> uses_;  // by the parser's index
};

}  // namespace

bool ParseFormula(std::string_view text, const std::vector<KnownName>& known,
                  const std::string& unit, Formula* formula,
                  FormulaFault* fault) {
  *formula = Formula();
  if (!FormulaParser(text, known, formula, fault).Parse()) return false;
  std::vector<std::string> units;
  for (const int i : formula->known) units.push_back(known[i].unit);
  formula->units = DeriveUnits(
      formula->tree, units, static_cast<int>(formula->parameters.size()), unit);
  return true;
}

std::string PointedAt(std::string_view text, size_t at) {
  constexpr size_t kBefore = 48, kAfter = 24;  // characters shown around
  std::string line(text);
  for (char& c : line) {
    if (IsBlank(c) || c == '\n') c = ' ';
  }
  std::string before = Printable(std::string_view(line).substr(0, at));
  std::string after = Printable(std::string_view(line).substr(at));
  if (const size_t letters = LettersOf(before); letters > kBefore) {
    before = "..." + before.substr(PlaceOf(before, letters - kBefore));
  }
  if (LettersOf(after) > kAfter) {
    after = after.substr(0, PlaceOf(after, kAfter)) + "...";
  }
  return "  " + before + after + "\n  " + std::string(LettersOf(before), ' ') +
         "^";
}

}  // namespace sysid
