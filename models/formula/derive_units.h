#pragma once

#include <string>
#include <vector>

#include "models/formula/syntax_tree.h"

namespace sysid {

// The units of the parameters of a formula, whose names are those with `units`
// and then the parameters. `whole` is the unit of its value. "-" stands for a
// plain number, "" for a unit that is not known, or does not follow.
//
// A unit is a product of powers of symbols: "N m s/rad", "N m/(rad s)". With
// the exponents of one symbol as unknowns, the formula is a system of linear
// equations:
//
// - Terms of a sum, and the arguments of min, max, atan2 and hypot, have one
//   unit; a product has the sum of the exponents, a power by a constant their
//   multiple.
// - The following are taken to be so where nothing in the formula contradicts,
//   in this order. The argument of exp, log and the like, and a power's base
//   and exponent where that is not constant, are plain numbers. The argument of
//   sin, cos and tan is in rad, or else a plain number; what asin and the like
//   give is a plain number. A constant is a plain number; but in an argument of
//   sin, cos and tan, a constant with a factor pi may have rad itself
//   (sin(2*pi*f*t): f in 1/s).
//
// Where the equations contradict each other no unit follows.
std::vector<std::string> DeriveUnits(const SyntaxTree& tree,
                                     const std::vector<std::string>& units,
                                     int parameters, const std::string& whole);

}  // namespace sysid
