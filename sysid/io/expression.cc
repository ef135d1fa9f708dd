#include "sysid/io/expression.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "models/error.h"
#include "models/formula/syntax_parser.h"
#include "sysid/io/cell.h"

namespace sysid {
namespace {

bool IsOperator(char c) {
  return c == '+' || c == '-' || c == '*' || c == '/' || c == '^';
}

}  // namespace

// The names are the columns of a header.
class ExpressionParser : private SyntaxParser {
 public:
  ExpressionParser(std::string_view text,
                   const std::vector<std::string>& header, Expression* out,
                   SyntaxFault* fault)
      : SyntaxParser(text,
                     {.operand = "a column, a number or '('",
                      .operators = "+ - * / ^",
                      .hint = "write column*number, (column-90)*0.0174532925 "
                              "or column1-column2; put odd names in quotes",
                      .zero_hint = "leave out what was not measured: of a "
                                   "frame's px, py, pz one or two are enough"},
                     &out->tree_, fault),
        header_(header),
        out_(out) {}

  bool Parse() {
    const auto whole = std::find(header_.begin(), header_.end(), Trim(text_));
    if (whole != header_.end() && !whole->empty()) {
      UseColumn(static_cast<int>(whole - header_.begin()));
      return true;
    }
    if (!ParseSum()) return false;
    out_->has_factor_ = has_factor();
    if (out_->columns_.empty()) {
      Fail(0, "there is no column in " + Shown(text_),
           "the file's columns are " + Join(header_));
      return false;
    }
    return true;
  }

  // The name that is no column, "" of other faults.
  const std::string& missing() const { return missing_; }

 private:
  bool EndsOperand(size_t at) const override {
    const char c = text_[at];
    return IsBlank(c) || c == ')' || IsOperator(c) || (c == ',' && in_call());
  }

  int Name() override {
    int best = -1;
    for (size_t i = 0; i < header_.size(); ++i) {
      const std::string& name = header_[i];
      double number;
      if (name.empty() || !rest().starts_with(name) ||
          (rest().size() > name.size() && !EndsOperand(at_ + name.size())) ||
          (best >= 0 && name.size() <= header_[best].size()) ||
          ParseNumber(name, &number)) {
        continue;
      }
      best = static_cast<int>(i);
    }
    if (best < 0) return kNone;
    at_ += header_[best].size();
    return UseColumn(best);
  }

  int QuotedName(size_t at, const std::string& name) override {
    const auto found = std::find(header_.begin(), header_.end(), name);
    if (found == header_.end()) return FailColumn(at, name);
    return UseColumn(static_cast<int>(found - header_.begin()));
  }

  // A name that is no column. "run-2" is rather a slip for the column "run-1"
  // than "run" minus 2.
  int Unknown() override {
    const std::string_view whole = Trim(rest());
    if (whole.find('*') == std::string_view::npos &&
        !NearestName(std::string(whole), header_).empty()) {
      return FailColumn(at_, std::string(whole));
    }
    size_t end = at_;
    while (end < text_.size() && !IsOperator(text_[end]) && text_[end] != ')' &&
           !(text_[end] == ',' && in_call())) {
      ++end;
    }
    return FailColumn(at_, std::string(Trim(text_.substr(at_, end - at_))));
  }

  int FailColumn(size_t at, const std::string& name) {
    missing_ = name;
    return Fail(at, "no column " + Shown(name), NameHint(name, header_));
  }

  int UseColumn(int column) {
    std::vector<int>& columns = out_->columns_;
    const auto found = std::find(columns.begin(), columns.end(), column);
    const int index = static_cast<int>(found - columns.begin());
    if (found == columns.end()) columns.push_back(column);
    return Use(index);
  }

  const std::vector<std::string>& header_;
  Expression* out_;
  std::string missing_;
};

Expression Expression::OfColumn(int column) {
  Expression expression;
  expression.columns_ = {column};
  expression.tree_ = SyntaxTree::OfName(0);
  return expression;
}

double Expression::Evaluate(std::span<const double> cells) const {
  for (size_t i = 0; i < columns_.size(); ++i) {
    if (std::isnan(cells[i])) return std::numeric_limits<double>::quiet_NaN();
  }
  if (is_column()) return cells[0];
  std::array<double, SyntaxTree::kMostNodes> scratch;
  return tree_.Evaluate(cells.data(), scratch.data());
}

bool ParseExpression(std::string_view text,
                     const std::vector<std::string>& header,
                     Expression* expression, ExpressionFault* fault) {
  *expression = Expression();
  SyntaxFault found;
  ExpressionParser parser(text, header, expression, &found);
  if (parser.Parse()) return true;
  *fault = {found.at, found.what, found.hint, parser.missing()};
  return false;
}

}  // namespace sysid
