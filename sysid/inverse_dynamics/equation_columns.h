#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "models/parameters.h"
#include "sysid/parameters/free_parameter.h"

namespace sysid {

// Columns of (11.2): the free parameters first, then those of each candidate.
struct EquationColumns {
  explicit EquationColumns(const Model& m) : model(m) {}

  Model model;  // with all candidates in it, off
  std::vector<Parameter> parameters;
  int free = 0;
  struct Candidate {
    std::shared_ptr<const Effect> effect;
    int first, count;
    // Whether its law takes away some of the measured effort (a friction by
    // load). Least squares of what the equations leave of it could then leave
    // nothing, and their likelihood means nothing.
    bool changes_effort;
  };
  std::vector<Candidate> candidates;
};

// Of the effects whose laws are linear in their parameters from where they are
// off, and which move nothing that is free or `known`; `start` is the model
// that they are looked for in.
EquationColumns MakeEquationColumns(
    const Model& start, const std::vector<FreeParameter>& free,
    const std::vector<std::shared_ptr<const Effect>>& effects,
    const std::set<std::string>& known);

}  // namespace sysid
