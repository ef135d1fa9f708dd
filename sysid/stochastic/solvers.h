#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sysid/estimation/stage_log.h"
#include "sysid/stochastic/stochastic_fit.h"

namespace sysid {

// The minimisers behind --solver. A new one is a function from a problem to a
// fit, and an entry in solvers.cc.

struct SolverOptions {
  AdamFitOptions adam;
  MixtureOptions mixture;
  StageLog* log = nullptr;  // of lm
};

struct Solved {
  Fit fit;
  std::optional<MixtureFit> mixture;  // of gmm
};

// What a solver fits the model to.
enum class SolverKind {
  kShooting,  // trajectories, with their states: joined segments
  // Trajectories from given first states, by Stan Math's gradients
  // (docs/stochastic.md); it starts where it is told.
  kStochastic,
  kEquations,  // the equations of motion (docs/inverse_dynamics.md)
};

struct Solver {
  const char* name;
  SolverKind kind;
  Solved (*solve)(const ShootingProblem& problem, const SolverOptions& options);
};

// In the order of KnownWords("solver").
const std::vector<Solver>& Solvers();
// By one of those names.
const Solver& FindSolver(const std::string& name);

}  // namespace sysid
