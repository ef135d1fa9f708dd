#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sysid/diagnosis/evaluated_model.h"

namespace sysid {

// What a law that no catalogue has may be a sum of: products of what the joint
// does, of what drives it, of what other joints do and of recorded inputs.
//
// With x one of q, qd, tau of the joint, y one of q, qd of a joint next to it
// or an input, b = 1 or x, and s, g, p, w that a fit finds:
//
//   powers      x1^a x2^b x3^c of degree 1 to 3;  y, y^2 and y^3, the first two
//               times b and y times x1 x2 as well
//   magnitudes  |x| b and |x| y;  |y| b and |y| y
//   turns       sin, cos of q, of 2 q and of those hinges' q, of q + those,
//               times b
//   saturation  x / (s + |x|), y / (s + |y|), tanh(qd / s) times 1, q, q^2,
//               |q|, |tau|, |y|, sin q and cos q
//   dead zones  sign(q) max(0, |q| - g)^n, n = 1 to 3, and the same of tau
//   places      (q - p) exp(-((q - p) / w)^2), exp(-(q / w)^2) qd,
//               exp(-|qd| / s) qd
//
// Nothing else is decided here: which of them are missing, if any, the search
// for sets of effects finds.

// A term c f: an effect that a user could have typed.
struct FormulaTerm {
  std::string joint;
  // f, as custom_law.h reads it, with "{s}" and "{w}" for numbers to find.
  std::string shape;
};

// c f with names for c and for what f has to find: "c3*tanh(qd/s3)".
std::string TextOf(const FormulaTerm& term, const std::string& number);

// Whether it is dry friction whose sign is smooth.
bool IsSmoothSign(const FormulaTerm& term);

// Of a joint: a hinge or slide. `driven`: whether it has an effort; `inputs`:
// names of what the law may read beside the joints.
std::vector<FormulaTerm> TermsOf(const Mechanism& mechanism, int joint,
                                 bool driven,
                                 const std::vector<std::string>& inputs);

// Those of a problem's joint, by what all of its runs have.
std::vector<FormulaTerm> TermsOf(const DiagnosisProblem& problem, int joint);

}  // namespace sysid
