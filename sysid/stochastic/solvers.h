#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sysid/stochastic/stochastic_fit.h"

namespace sysid {

// The minimisers behind --solver. A new one is a function from a problem to a
// fit, and an entry in solvers.cc.

struct SolverOptions {
  AdamFitOptions adam;
  MixtureOptions mixture;
};

struct Solved {
  Fit fit;
  std::optional<MixtureFit> mixture;  // of gmm
};

struct Solver {
  const char* name;
  // Whether it descends by Stan Math's gradients over rollouts whose first
  // states are given (docs/stochastic.md), and starts where it is told.
  bool stochastic;
  Solved (*solve)(const ShootingProblem& problem, const SolverOptions& options);
};

// In the order of KnownWords("solver").
const std::vector<Solver>& Solvers();
// By one of those names.
const Solver& FindSolver(const std::string& name);

}  // namespace sysid
