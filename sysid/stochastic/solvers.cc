#include "sysid/stochastic/solvers.h"

#include <algorithm>

#include "glog/logging.h"
#include "sysid/inverse_dynamics/effort_comparison.h"
#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"

namespace sysid {

namespace {

Fit WithEfforts(const ShootingProblem& problem, Fit fit) {
  const EffortComparison comparison = CompareEfforts(problem, fit.point.theta);
  fit.effort = comparison.errors;
  fit.cut_off_hz = comparison.cut_off_hz;
  return fit;
}

}  // namespace

const std::vector<Solver>& Solvers() {
  static const std::vector<Solver>& all = *new std::vector<Solver>{
      {"lm", SolverKind::kShooting,
       [](const ShootingProblem& problem, const SolverOptions& options) {
         return Solved{WithEfforts(problem, FitLevenbergMarquardt(
                                                StartByInverseDynamics(problem),
                                                options.log)),
                       std::nullopt};
       }},
      {"inverse_dynamics", SolverKind::kEquations,
       [](const ShootingProblem& problem, const SolverOptions&) {
         return Solved{FitInverseDynamics(problem), std::nullopt};
       }},
      {"adam", SolverKind::kStochastic,
       [](const ShootingProblem& problem, const SolverOptions& options) {
         return Solved{WithEfforts(problem, FitAdam(problem, options.adam)),
                       std::nullopt};
       }},
      {"gmm", SolverKind::kStochastic,
       [](const ShootingProblem& problem, const SolverOptions& options) {
         const MixtureFit mixture =
             FitGaussianMixture(problem, options.mixture);
         return Solved{WithEfforts(problem, mixture.fit), mixture};
       }},
  };
  return all;
}

const Solver& FindSolver(const std::string& name) {
  const std::vector<Solver>& all = Solvers();
  const auto at =
      std::find_if(all.begin(), all.end(),
                   [&](const Solver& solver) { return solver.name == name; });
  CHECK(at != all.end()) << name;
  return *at;
}

}  // namespace sysid
