#pragma once

#include <string>
#include <vector>

#include "sysid/estimation/estimates.h"

namespace sysid {

// A law for what no effect of the catalogue explains: not known from physics,
// but read off the data.
struct FormulaProposal {
  // "custom@joint2: c1*q^2*qd", one for each joint on which it acts.
  std::vector<std::string> laws;
  // Effects of the catalogue that are in the model beside them.
  std::vector<std::string> beside;
  // Effects of the catalogue's answer that it replaces by another law. (One
  // that only smooths the sign in a dry friction is the same law.)
  std::vector<std::string> replaces;
  std::vector<ParameterEstimate> parameters;  // of laws
  double cv_error = 0.0, holdout = 0.0;       // normalised
  double segment_s = 0.0;                     // over which the errors are

  std::vector<std::string> effects() const;  // laws, then beside
};

}  // namespace sysid
