#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "models/parameters.h"
#include "sysid/parameters/free_parameter.h"

namespace sysid {

// Columns of (11.2): the free parameters first, then those of each candidate.
// The columns of a candidate are its probes (effect.h), the derivatives of the
// equations where its law is off; a law with a parameter that must be searched
// (the order of a cogging, the velocity of a Stribeck peak) is one candidate
// for each value that is tried.
struct EquationColumns {
  struct Candidate {
    std::shared_ptr<const Effect> effect;
    // Of the first columns; those of Effect::adjusts_nominal() come after.
    ProbeSet probes;
    int first = 0, count = 0;
    std::vector<Parameter> parameters;  // Effect::ParameterNames()
    // Of parameters(): what it takes over from a law of the model, 0 where
    // nothing; and the free columns of that law, which it has the place of.
    std::vector<double> taken_over;
    std::vector<int> replaces;
    // Whether its weights are changes of its parameters, by column.
    bool is_linear = true;
  };
  // What is evaluated together: laws that share parameters, and values of one
  // law, come one after another.
  struct Pass {
    Model model;
    std::vector<Parameter> parameters;  // by which it is derived
    std::vector<int> columns;           // those of the parameters
    // Whether its laws read the drives' efforts. A column of the measured ones
    // would explain what is missing by itself: these are the modelled efforts.
    bool reads_effort = false;
  };

  int free = 0;
  // By column: its parameter, and the value at which it is derived.
  std::vector<std::string> names;
  Eigen::VectorXd at;
  std::vector<Candidate> candidates;
  std::vector<Pass> passes;  // the first has the free parameters

  int size() const { return static_cast<int>(names.size()); }
  // Values of Effect::ParameterNames(), SI, of these weights of its columns.
  std::vector<double> Values(const Candidate& candidate,
                             const Eigen::VectorXd& weights) const;
  // Whether no model can have both.
  static bool Exclude(const Candidate& a, const Candidate& b);
};

// Of the effects that are linear in weights of their probes and move nothing
// that is `known`, or free already; `start` is the model that they are looked
// for in. `searched`: laws with searched parameters, too.
EquationColumns MakeEquationColumns(
    const Model& start, const std::vector<FreeParameter>& free,
    const std::vector<std::shared_ptr<const Effect>>& effects,
    const std::set<std::string>& known, bool all_laws);

}  // namespace sysid
