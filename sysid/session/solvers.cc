#include "sysid/session/solvers.h"

#include <algorithm>

#include "glog/logging.h"

namespace sysid {
namespace {

Solved ByLevenbergMarquardt(const ShootingProblem& problem,
                            const SolverOptions&) {
  return {FitLevenbergMarquardt(problem), std::nullopt};
}

Solved ByAdam(const ShootingProblem& problem, const SolverOptions& options) {
  return {FitAdam(problem, options.adam), std::nullopt};
}

Solved ByMixture(const ShootingProblem& problem, const SolverOptions& options) {
  MixtureFit mixture = FitGaussianMixture(problem, options.mixture);
  Solved solved{mixture.fit, std::nullopt};
  solved.mixture = std::move(mixture);
  return solved;
}

}  // namespace

const std::vector<Solver>& Solvers() {
  static const std::vector<Solver>& all = *new std::vector<Solver>{
      {"lm", false, ByLevenbergMarquardt},
      {"adam", true, ByAdam},
      {"gmm", true, ByMixture},
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
