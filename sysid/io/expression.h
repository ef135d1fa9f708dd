#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "models/formula/syntax_tree.h"

namespace sysid {

// Arithmetic over the columns of a file: what stands behind '=' in --columns.
// The grammar is that of formulas (models/formula/syntax_parser.h), and the
// names are columns.
//
// The columns are those of the header, so their names need no form: a column
// that has exactly the name of the whole expression wins, then, at each factor,
// the longest column that begins there and ends before a space, an operator or
// the end. So "/joint_states/pos[0]*2" and "run-1" read as one hopes; where it
// would not, the name is put in quotes. A number is a number, and not a column
// of that name, unless it is the whole expression or in quotes. A function is a
// name of one followed by '(', unless there is a column that begins so.
class Expression {
 public:
  Expression() = default;

  // The column as it stands.
  static Expression OfColumn(int column);

  // Indices into the header of the columns it uses, each once, in the order of
  // their first use; at least one.
  const std::vector<int>& columns() const { return columns_; }
  // Whether it is one column as it stands.
  bool is_column() const { return tree_.is_name(); }
  // Whether it does anything but add and subtract: the user wrote a scale, be
  // it 1.
  bool has_factor() const { return has_factor_; }

  // The value where columns()[i] has cells[i]. NaN (missing) where any of them
  // is missing; infinite or NaN otherwise where it is not defined there.
  double Evaluate(std::span<const double> cells) const;

 private:
  friend class ExpressionParser;
  SyntaxTree tree_;  // over columns_
  std::vector<int> columns_;
  bool has_factor_ = false;
};

// What is wrong with an expression.
struct ExpressionFault {
  size_t at = 0;  // where in the text, from 0
  std::string what;
  std::string hint;
  std::string column;  // the name that is no column, "" for other faults
};

// Reads `text` against a header. False and the fault where it is none: a name
// that the header does not have, an operator or parenthesis that is missing or
// too many, a function without its arguments, no column at all, a
// multiplication by zero, a division by it, a constant that is not finite, too
// deep or too long an expression.
bool ParseExpression(std::string_view text,
                     const std::vector<std::string>& header,
                     Expression* expression, ExpressionFault* fault);

}  // namespace sysid
