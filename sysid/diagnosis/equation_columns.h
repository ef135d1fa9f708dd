#pragma once

#include <memory>
#include <vector>

#include "models/parameters.h"
#include "sysid/diagnosis/evaluated_model.h"

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
// off; `start` is the problem's model as the search begins with it.
EquationColumns MakeEquationColumns(
    const DiagnosisProblem& problem, const Model& start,
    const std::vector<std::shared_ptr<const Effect>>& effects);

}  // namespace sysid
