#include "sysid/io/expression.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "models/error.h"
#include "sysid/io/cell.h"

namespace sysid {
namespace {

// Deep enough for anything written by hand; the parser recurses.
constexpr int kDeepest = 50;

bool IsOperator(char c) { return c == '+' || c == '-' || c == '*' || c == '/'; }

// What may stand behind a column or number.
bool EndsOperand(char c) { return IsBlank(c) || c == ')' || IsOperator(c); }

}  // namespace

// Recursive descent; each function gives the node of what it read, or kNone.
class ExpressionParser {
 public:
  ExpressionParser(std::string_view text,
                   const std::vector<std::string>& header, Expression* out,
                   ExpressionFault* fault)
      : text_(text), header_(header), out_(out), fault_(fault) {}

  bool Parse() {
    const auto whole = std::find(header_.begin(), header_.end(), Trim(text_));
    if (whole != header_.end() && !whole->empty()) {
      Use(static_cast<int>(whole - header_.begin()));
      return true;
    }
    if (Sum() < 0) return false;
    SkipSpaces();
    if (at_ < text_.size()) {
      Fail(at_, text_[at_] == ')'
                    ? "a ')' that closes nothing"
                    : "an operator (+ - * /) is expected before " +
                          Shown(text_.substr(at_)));
      return false;
    }
    if (out_->columns_.empty()) {
      Fail(0, "there is no column in " + Shown(text_),
           "the file's columns are " + Join(header_));
      return false;
    }
    return true;
  }

 private:
  using Op = Expression::Op;
  static constexpr int kNone = -1;  // instead of a node: a fault

  int Fail(size_t at, std::string what, std::string hint = "") {
    fault_->at = at;
    fault_->what = std::move(what);
    fault_->hint = hint.empty()
                       ? "write column*number, (column-90)*0.0174532925 or "
                         "column1-column2; put odd names in quotes"
                       : std::move(hint);
    return kNone;
  }

  void SkipSpaces() {
    while (at_ < text_.size() && IsBlank(text_[at_])) ++at_;
  }
  // The operator at the cursor if it is one of these, else 0.
  char TakeOperator(char a, char b) {
    SkipSpaces();
    if (at_ == text_.size() || (text_[at_] != a && text_[at_] != b)) return 0;
    return text_[at_++];
  }

  // Operands and the operators between them, from the left.
  int Chain(char a, Op op_a, char b, Op op_b,
            int (ExpressionParser::*operand)()) {
    int left = (this->*operand)();
    while (left >= 0) {
      const char op = TakeOperator(a, b);
      if (op == 0) break;
      const size_t at = at_ - 1;
      const int right = (this->*operand)();
      left = Combine(op == a ? op_a : op_b, left, right, at);
    }
    return left;
  }

  int Sum() {
    return Chain('+', Op::kAdd, '-', Op::kSubtract, &ExpressionParser::Product);
  }

  int Product() {
    return Chain('*', Op::kMultiply, '/', Op::kDivide,
                 &ExpressionParser::Factor);
  }

  int Factor() {
    SkipSpaces();
    if (at_ == text_.size()) {
      return Fail(at_, "a column, a number or '(' is expected at its end");
    }
    // A column first: its name may begin with anything.
    if (const int column = Column(); column >= 0) return column;
    const char c = text_[at_];
    if (c == '(' || c == '-' || c == '+') return SignOrParenthesis(c);
    if (c == '\'' || c == '"') return Quoted(c);
    if (const int number = Number(); number >= 0) return number;
    if (const int number = Pi(); number >= 0) return number;
    if (c == '*' || c == '/' || c == ')') {
      return Fail(at_, std::string("a column, a number or '(' is expected "
                                   "before '") +
                           c + "'");
    }
    return FailName();
  }

  int SignOrParenthesis(char c) {
    if (depth_ == kDeepest) {
      return Fail(at_, "more than " + std::to_string(kDeepest) +
                           " signs and parentheses in each other");
    }
    ++depth_;
    const size_t begin = at_++;
    int node = c == '(' ? Sum() : Factor();
    --depth_;
    if (node < 0) return kNone;
    if (c == '+') return node;
    if (c == '-') {
      out_->has_factor_ = true;
      return Negate(node);
    }
    SkipSpaces();
    if (at_ == text_.size()) return Fail(begin, "a '(' that is not closed");
    if (text_[at_] != ')') {
      return Fail(at_, "an operator (+ - * /) or ')' is expected before " +
                           Shown(text_.substr(at_)));
    }
    ++at_;
    return node;
  }

  // The longest column that begins at the cursor.
  int Column() {
    const std::string_view rest = text_.substr(at_);
    int best = -1;
    for (size_t i = 0; i < header_.size(); ++i) {
      const std::string& name = header_[i];
      double number;
      if (name.empty() || !rest.starts_with(name) ||
          (rest.size() > name.size() && !EndsOperand(rest[name.size()])) ||
          (best >= 0 && name.size() <= header_[best].size()) ||
          ParseNumber(name, &number)) {
        continue;
      }
      best = static_cast<int>(i);
    }
    if (best < 0) return kNone;
    at_ += header_[best].size();
    return Use(best);
  }

  int Quoted(char quote) {
    const size_t begin = at_ + 1;
    const size_t end = text_.find(quote, begin);
    if (end == std::string_view::npos) {
      return Fail(at_, "a quotation mark that is not closed");
    }
    const std::string name(text_.substr(begin, end - begin));
    const auto found = std::find(header_.begin(), header_.end(), name);
    if (found == header_.end()) return FailColumn(at_, name);
    at_ = end + 1;
    return Use(static_cast<int>(found - header_.begin()));
  }

  int Number() {
    const char first = text_[at_];
    if (first != '.' && (first < '0' || first > '9')) return kNone;
    double value;
    const char* const begin = text_.data() + at_;
    const auto [rest, error] =
        std::from_chars(begin, text_.data() + text_.size(), value);
    const size_t end = at_ + static_cast<size_t>(rest - begin);
    if (error != std::errc() ||
        (end < text_.size() && !EndsOperand(text_[end]))) {
      return kNone;
    }
    at_ = end;
    return Add({Op::kNumber, 0, 0, value});
  }

  int Pi() {
    const std::string_view rest = text_.substr(at_);
    if (!rest.starts_with("pi") || (rest.size() > 2 && !EndsOperand(rest[2]))) {
      return kNone;
    }
    at_ += 2;
    return Add({Op::kNumber, 0, 0, std::numbers::pi});
  }

  // A name that is no column. "run-2" is rather a slip for the column "run-1"
  // than "run" minus 2.
  int FailName() {
    const std::string_view rest = Trim(text_.substr(at_));
    if (rest.find('*') == std::string_view::npos &&
        !NearestName(std::string(rest), header_).empty()) {
      return FailColumn(at_, std::string(rest));
    }
    size_t end = at_;
    while (end < text_.size() && !IsOperator(text_[end]) && text_[end] != ')') {
      ++end;
    }
    return FailColumn(at_, std::string(Trim(text_.substr(at_, end - at_))));
  }

  int FailColumn(size_t at, const std::string& name) {
    fault_->column = name;
    return Fail(at, "no column " + Shown(name), NameHint(name, header_));
  }

  int Add(const Expression::Node& node) {
    if (out_->nodes_.size() == Expression::kMostNodes) {
      return Fail(at_, "more than " + std::to_string(Expression::kMostNodes) +
                           " operations");
    }
    out_->nodes_.push_back(node);
    return static_cast<int>(out_->nodes_.size()) - 1;
  }

  int Use(int column) {
    std::vector<int>& columns = out_->columns_;
    const auto found = std::find(columns.begin(), columns.end(), column);
    const int index = static_cast<int>(found - columns.begin());
    if (found == columns.end()) columns.push_back(column);
    return Add({Op::kColumn, index, 0, 0.0});
  }

  bool IsNumber(int node) const { return out_->nodes_[node].op == Op::kNumber; }

  int Negate(int node) {
    if (!IsNumber(node)) return Add({Op::kNegate, node, 0, 0.0});
    out_->nodes_[node].number *= -1;
    return node;
  }

  int Combine(Op op, int left, int right, size_t at) {
    if (right < 0) return kNone;
    out_->has_factor_ |= op == Op::kMultiply || op == Op::kDivide;
    const double a = out_->nodes_[left].number;
    const double b = out_->nodes_[right].number;
    const bool zero_a = IsNumber(left) && a == 0.0;
    const bool zero_b = IsNumber(right) && b == 0.0;
    if (op == Op::kDivide && zero_b) return Fail(at, "a division by zero");
    if (op == Op::kMultiply && (zero_a || zero_b)) {
      return Fail(at, "a factor that is zero",
                  "leave out what was not measured: of a frame's px, py, pz "
                  "one or two are enough");
    }
    if (!IsNumber(left) || !IsNumber(right)) {
      return Add({op, left, right, 0.0});
    }
    // Two numbers are one; they are the last two nodes.
    out_->nodes_.pop_back();
    double& value = out_->nodes_.back().number;
    value = Expression::Apply(op, a, b);
    if (!std::isfinite(value)) return Fail(at, "a number that is not finite");
    return left;
  }

  std::string_view text_;
  const std::vector<std::string>& header_;
  Expression* out_;
  ExpressionFault* fault_;
  size_t at_ = 0;
  int depth_ = 0;
};

Expression Expression::OfColumn(int column) {
  Expression expression;
  expression.columns_ = {column};
  expression.nodes_ = {{Op::kColumn, 0, 0, 0.0}};
  return expression;
}

double Expression::Apply(Op op, double left, double right) {
  switch (op) {
    case Op::kAdd:
      return left + right;
    case Op::kSubtract:
      return left - right;
    case Op::kMultiply:
      return left * right;
    case Op::kDivide:
      return left / right;
    default:
      return -left;
  }
}

double Expression::Evaluate(std::span<const double> cells) const {
  for (size_t i = 0; i < columns_.size(); ++i) {
    if (std::isnan(cells[i])) return std::numeric_limits<double>::quiet_NaN();
  }
  if (is_column()) return cells[0];
  std::array<double, kMostNodes> values;
  for (size_t i = 0; i < nodes_.size(); ++i) {
    const Node& node = nodes_[i];
    values[i] = node.op == Op::kColumn ? cells[node.left]
                : node.op == Op::kNumber
                    ? node.number
                    : Apply(node.op, values[node.left], values[node.right]);
  }
  return values[nodes_.size() - 1];
}

bool ParseExpression(std::string_view text,
                     const std::vector<std::string>& header,
                     Expression* expression, ExpressionFault* fault) {
  *expression = Expression();
  return ExpressionParser(text, header, expression, fault).Parse();
}

}  // namespace sysid
