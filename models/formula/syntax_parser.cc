#include "models/formula/syntax_parser.h"

#include <charconv>
#include <cmath>
#include <numbers>
#include <utility>

#include "models/printable.h"

namespace sysid {
namespace {

// Deep enough for anything written by hand; the parser recurses.
constexpr int kDeepest = 50;

// A number in which pi is a factor, made of two.
bool OfPi(SyntaxTree::Op op, bool left, bool right) {
  const bool product =
      op == SyntaxTree::Op::kMultiply || op == SyntaxTree::Op::kDivide;
  const bool sum =
      op == SyntaxTree::Op::kAdd || op == SyntaxTree::Op::kSubtract;
  return product ? left != right : sum && left && right;
}

}  // namespace

const SyntaxTree::Function* FindFunction(std::string_view name) {
  for (const SyntaxTree::Function& function : SyntaxTree::Functions()) {
    if (function.name == name) return &function;
  }
  return nullptr;
}

bool SyntaxParser::ParseSum() {
  if (Sum() < 0) return false;
  SkipBlanks();
  if (at_ == text_.size()) return true;
  if (text_[at_] == ')') {
    Fail(at_, "a ')' that closes nothing");
  } else {
    FailOperator(at_);
  }
  return false;
}

int SyntaxParser::Fail(size_t at, std::string what, std::string hint) {
  fault_->at = at;
  fault_->what = std::move(what);
  if (hint.empty()) hint = words_.hint;
  fault_->hint = std::move(hint);
  return kNone;
}

int SyntaxParser::FailOperator(size_t at, const std::string& or_else) {
  return Fail(at, "an operator (" + words_.operators + ")" + or_else +
                      " is expected before " + Shown(text_.substr(at)));
}

int SyntaxParser::FailOperand() {
  return Fail(at_, words_.operand + " is expected before '" + text_[at_] + "'");
}

void SyntaxParser::SkipBlanks() {
  while (at_ < text_.size() && IsBlank(text_[at_])) ++at_;
}

std::string_view SyntaxParser::Identifier() const {
  size_t end = at_;
  if (end < text_.size() && !IsDigit(text_[end])) {
    while (end < text_.size() && IsWordLetter(text_[end])) ++end;
  }
  return text_.substr(at_, end - at_);
}

bool SyntaxParser::IsCalled(size_t at) const {
  while (at < text_.size() && IsBlank(text_[at])) ++at;
  return at < text_.size() && text_[at] == '(';
}

// The operator at the cursor if it is one of these, else 0.
char SyntaxParser::TakeOperator(char a, char b) {
  SkipBlanks();
  if (at_ == text_.size() || (text_[at_] != a && text_[at_] != b)) return 0;
  return text_[at_++];
}

// Operands and the operators between them, from the left.
int SyntaxParser::Chain(char a, Op op_a, char b, Op op_b,
                        int (SyntaxParser::*operand)()) {
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

int SyntaxParser::Sum() {
  return Chain('+', Op::kAdd, '-', Op::kSubtract, &SyntaxParser::Product);
}

int SyntaxParser::Product() {
  return Chain('*', Op::kMultiply, '/', Op::kDivide, &SyntaxParser::Factor);
}

int SyntaxParser::Factor() {
  SkipBlanks();
  if (at_ == text_.size()) {
    return Fail(at_, words_.operand + " is expected at its end");
  }
  if (const int name = Name(); name >= 0) return PowerOf(name);
  const char c = text_[at_];
  return c == '-' || c == '+' ? Signed() : PowerOf(Operand());
}

int SyntaxParser::PowerOf(int base) {
  if (base < 0) return kNone;
  SkipBlanks();
  if (at_ == text_.size() || text_[at_] != '^') return base;
  if (!Enter("powers, signs")) return kNone;
  const size_t at = at_++;
  const int exponent = Factor();
  --depth_;
  return CombinePower(base, exponent, at);
}

int SyntaxParser::Operand() {
  const std::string_view identifier = Identifier();
  if (const SyntaxTree::Function* function = FindFunction(identifier);
      function != nullptr && IsCalled(at_ + identifier.size())) {
    return Call(*function);
  }
  const char c = text_[at_];
  if (c == '(') return Parenthesis();
  if (c == '\'' || c == '"') return Quoted();
  if (const int number = Number(); number >= 0) return number;
  if (const int number = Pi(); number >= 0) return number;
  if (c == '*' || c == '/' || c == '^' || c == ')' || (c == ',' && in_call())) {
    return FailOperand();
  }
  return Unknown();
}

bool SyntaxParser::Enter(const std::string& what) {
  if (depth_ == kDeepest) {
    Fail(at_, "more than " + std::to_string(kDeepest) + " " + what +
                  " and parentheses in each other");
    return false;
  }
  ++depth_;
  return true;
}

int SyntaxParser::Signed() {
  if (!Enter("signs")) return kNone;
  const bool minus = text_[at_++] == '-';
  const int node = Factor();
  --depth_;
  return node < 0 || !minus ? node : Negate(node);
}

int SyntaxParser::Parenthesis() {
  if (!Enter("signs")) return kNone;
  const size_t begin = at_++;
  const int node = Sum();
  --depth_;
  if (node < 0) return kNone;
  SkipBlanks();
  if (at_ == text_.size()) return Fail(begin, "a '(' that is not closed");
  if (text_[at_] != ')') return FailOperator(at_, " or ')'");
  ++at_;
  return node;
}

int SyntaxParser::Quoted() {
  const size_t begin = at_ + 1;
  const size_t end = text_.find(text_[at_], begin);
  if (end == std::string_view::npos) {
    return Fail(at_, "a quotation mark that is not closed");
  }
  const int node =
      QuotedName(at_, std::string(text_.substr(begin, end - begin)));
  if (node >= 0) at_ = end + 1;
  return node;
}

int SyntaxParser::Number() {
  const char first = text_[at_];
  if (first != '.' && !IsDigit(first)) return kNone;
  double value;
  const char* const begin = text_.data() + at_;
  const auto [rest, error] =
      std::from_chars(begin, text_.data() + text_.size(), value);
  const size_t end = at_ + static_cast<size_t>(rest - begin);
  if (error != std::errc() || (end < text_.size() && !EndsOperand(end))) {
    return kNone;
  }
  at_ = end;
  return AddNumber(value);
}

int SyntaxParser::Pi() {
  if (!rest().starts_with("pi") ||
      (rest().size() > 2 && !EndsOperand(at_ + 2))) {
    return kNone;
  }
  at_ += 2;
  return Add({Op::kNumber, 0, 0, std::numbers::pi, true});
}

int SyntaxParser::Call(const SyntaxTree::Function& function) {
  const size_t at = at_;
  at_ += function.name.size();
  SkipBlanks();
  if (!Enter("signs")) return kNone;
  ++calls_;
  const size_t begin = at_;
  int arguments[2] = {0, 0};
  int count = 0;
  do {
    ++at_;
    const int argument = Sum();
    if (argument < 0) return kNone;
    if (count < 2) arguments[count] = argument;
    ++count;
    SkipBlanks();
    if (at_ == text_.size()) return Fail(begin, "a '(' that is not closed");
    if (text_[at_] != ')' && text_[at_] != ',') {
      return FailOperator(at_, ", ',' or ')'");
    }
  } while (text_[at_] == ',');
  ++at_;
  --calls_;
  --depth_;
  if (count != function.arguments) {
    return Fail(at, std::string(function.name) +
                        (function.arguments == 1
                             ? " takes one argument"
                             : " takes two arguments, such as " +
                                   std::string(function.name) + "(a, b)") +
                        ", and not " + std::to_string(count));
  }
  return Combine(function.op, arguments[0],
                 function.arguments == 2 ? arguments[1] : 0, at);
}

int SyntaxParser::Add(const SyntaxTree::Node& node) {
  if (tree_->size() == SyntaxTree::kMostNodes) {
    return Fail(at_, "more than " + std::to_string(SyntaxTree::kMostNodes) +
                         " operations");
  }
  return tree_->Add(node);
}

int SyntaxParser::Negate(int node) {
  has_factor_ = true;
  if (!IsNumber(node)) return Add({Op::kNegate, node, 0, 0.0});
  tree_->node(node).number *= -1;
  return node;
}

// `right` of an operation on one operand is 0.
int SyntaxParser::Combine(Op op, int left, int right, size_t at) {
  if (right < 0) return kNone;
  has_factor_ |= op != Op::kAdd && op != Op::kSubtract;
  const auto is_zero = [&](int i) {
    return IsNumber(i) && tree_->nodes()[i].number == 0.0;
  };
  if (op == Op::kDivide && is_zero(right)) {
    return Fail(at, "a division by zero");
  }
  if (op == Op::kMultiply && (is_zero(left) || is_zero(right))) {
    return Fail(at, "a factor that is zero", words_.zero_hint);
  }
  if (IsNumber(left) && (right == 0 || IsNumber(right))) {
    return Fold(op, left, right, at);
  }
  return Add({op, left, right, 0.0});
}

// A constant whole exponent is no operand: it has no derivative.
int SyntaxParser::CombinePower(int left, int right, size_t at) {
  if (right < 0) return kNone;
  const double exponent = tree_->nodes()[right].number;
  if (IsNumber(left) || !IsNumber(right) || exponent != std::floor(exponent) ||
      std::abs(exponent) > SyntaxTree::kMostPower) {
    return Combine(Op::kPower, left, right, at);
  }
  has_factor_ = true;
  tree_->DropLast();
  return Add({Op::kWholePower, left, static_cast<int>(exponent), 0.0});
}

// What is made of numbers is one; they are the last nodes.
int SyntaxParser::Fold(Op op, int left, int right, size_t at) {
  const SyntaxTree::Node a = tree_->nodes()[left];
  SyntaxTree::Node b = tree_->nodes()[right];
  if (right != 0) tree_->DropLast();
  SyntaxTree::Node& folded = tree_->node(left);
  folded.number = SyntaxTree::Apply(op, a.number, b.number);
  folded.of_pi = OfPi(op, a.of_pi, b.of_pi);
  if (!std::isfinite(folded.number)) {
    return Fail(at, "a number that is not finite");
  }
  return left;
}

}  // namespace sysid
