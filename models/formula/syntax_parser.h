#pragma once

#include <string>
#include <string_view>

#include "models/formula/syntax_tree.h"

namespace sysid {

// What is wrong with an expression.
struct SyntaxFault {
  size_t at = 0;  // where in the text, from 0
  std::string what;
  std::string hint;
};

// The grammar of expressions (recursive descent):
//
//   sum     = product { (+|-) product }
//   product = factor { (*|/) factor }
//   factor  = (+|-) factor | power
//   power   = operand [ ^ factor ]
//   operand = name | function ( sum { , sum } ) | ( sum ) | number | pi
//
// So -q^2 is -(q^2), 2^3^2 is 2^9 and 2^-1 is a half. A name comes first: it
// may look like anything. What names there are, and what something is that is
// none of the grammar, says the flavour that derives from this.
class SyntaxParser {
 public:
  SyntaxParser(const SyntaxParser&) = delete;
  SyntaxParser& operator=(const SyntaxParser&) = delete;

 protected:
  // The flavour's words.
  struct Words {
    std::string operand;    // "a column, a number or '('"
    std::string operators;  // "+ - * / ^"
    std::string hint;       // of what has no better one
    std::string zero_hint;  // of a factor that is zero
  };
  static constexpr int kNone = -1;  // instead of a node: a fault, or not this

  SyntaxParser(std::string_view text, Words words, SyntaxTree* tree,
               SyntaxFault* fault)
      : text_(text), words_(std::move(words)), tree_(tree), fault_(fault) {}
  ~SyntaxParser() = default;

  // The node of the longest name that begins at the cursor, which moves behind
  // it; kNone where none does.
  virtual int Name() = 0;
  // The node of the name that stands in quotes at `at`; else a fault.
  virtual int QuotedName(size_t at, const std::string& name) = 0;
  // What is none of the grammar's operands: a node or a fault.
  virtual int Unknown() = 0;
  // Whether a name or number may end before the character at `at`.
  virtual bool EndsOperand(size_t at) const = 0;

  // The whole text; false is a fault.
  bool ParseSum();

  // Reports a fault. Gives kNone.
  int Fail(size_t at, std::string what, std::string hint = "");
  // That an operator (or what else) is missing before what follows `at`.
  int FailOperator(size_t at, const std::string& or_else = "");
  int FailOperand();
  // The node of a name by its index.
  int Use(int name) { return Add({SyntaxTree::Op::kName, name, 0, 0.0}); }
  int AddNumber(double value) {
    return Add({SyntaxTree::Op::kNumber, 0, 0, value});
  }

  std::string_view rest() const { return text_.substr(at_); }
  void SkipBlanks();
  // The letters, digits and underscores that begin at the cursor with a letter.
  std::string_view Identifier() const;
  // Whether '(' follows, after blanks, on the character before `at`.
  bool IsCalled(size_t at) const;

  // Whether it does anything but add and subtract.
  bool has_factor() const { return has_factor_; }
  // Whether the cursor is among the arguments of a function.
  bool in_call() const { return calls_ > 0; }

  const std::string_view text_;
  size_t at_ = 0;  // the cursor

 private:
  using Op = SyntaxTree::Op;

  char TakeOperator(char a, char b);
  int Chain(char a, Op op_a, char b, Op op_b, int (SyntaxParser::*operand)());
  int Sum();
  int Product();
  int Factor();
  int PowerOf(int base);
  int Operand();
  int Signed();
  int Parenthesis();
  int Quoted();
  int Number();
  int Pi();
  int Call(const SyntaxTree::Function& function);
  bool Enter(const std::string& what);

  int Add(const SyntaxTree::Node& node);
  int Negate(int node);
  int Combine(Op op, int left, int right, size_t at);
  int CombinePower(int left, int right, size_t at);
  int Fold(Op op, int left, int right, size_t at);
  bool IsNumber(int node) const {
    return tree_->nodes()[node].op == Op::kNumber;
  }

  const Words words_;
  SyntaxTree* tree_;
  SyntaxFault* fault_;
  int depth_ = 0;
  int calls_ = 0;
  bool has_factor_ = false;
};

// The function that is called so; null if none is.
const SyntaxTree::Function* FindFunction(std::string_view name);

// Whether it may stand in an identifier; a digit not at its beginning.
inline bool IsWordLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
         (c >= '0' && c <= '9') || c == '_';
}
inline bool IsDigit(char c) { return c >= '0' && c <= '9'; }

}  // namespace sysid
