#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "models/formula/syntax_parser.h"
#include "models/formula/syntax_tree.h"

namespace sysid {

// What a name in a formula may be, and its unit: "q" in "rad", "joint2.qd" in
// "rad/s"; "-" is that of a plain number, "" one that is not known.
struct KnownName {
  std::string name;
  std::string unit;
};

// A law as a user types it: -c*tanh(qd/v) - k*q^3.
struct Formula {
  // Its names are the known ones that it reads, then the parameters.
  SyntaxTree tree;
  // Indices of the known names, each once, in order of their first use.
  std::vector<int> known;
  // In order of their first use; at least one.
  std::vector<std::string> parameters;
  // Of each parameter, as it follows from the formula: "N m/rad^3", "-" of a
  // plain number, "" where it does not follow (derive_units.h).
  std::vector<std::string> units;
};

// `at` is a character (byte) of the text, or its end.
using FormulaFault = SyntaxFault;

// Reads a formula whose value has `unit`. The grammar is that of
// syntax_parser.h. Names:
//
// - At each place the longest known name that stands there as a whole is taken.
//   One that would be read differently is put in quotes: 'my joint.q'.
// - Another identifier is a parameter: letters, digits and underscores, not
//   with a digit first.
// - An identifier with '(' behind it is a function, and one with dots
//   (joint2.q) an input or joint; what is not known of these is a fault, as is
//   a function's name without '('.
// - pi is the number, unless it is known.
//
// False and the fault where it is none of these, an operator, parenthesis or
// argument is missing or too many, it multiplies or divides by zero, a constant
// is not finite, it is too deep or too long, or has no parameter.
bool ParseFormula(std::string_view text, const std::vector<KnownName>& known,
                  const std::string& unit, Formula* formula,
                  FormulaFault* fault);

// The text in a line of its own with a caret below the character `at`, both
// indented by two; of a long text the part around it. To append to a message.
std::string PointedAt(std::string_view text, size_t at);

}  // namespace sysid
