#include "sysid/stochastic/solvers.h"

#include <gmock/gmock.h>

#include "sysid/parameters/fit_specification.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

// What a specification may name is what there is.
TEST(Solvers, AreThoseThatASpecificationMayName) {
  std::vector<std::string> names;
  for (const Solver& solver : Solvers()) {
    names.push_back(solver.name);
    EXPECT_EQ(&FindSolver(solver.name), &solver);
  }
  EXPECT_EQ(names, KnownWords("solver"));
}

TEST(Solvers, SolveTheProblemThatTheyAreGiven) {
  const Model model = Shipped("pendulum1");
  SimulationOptions simulation;
  simulation.duration = 2.0;
  simulation.noise = 1e-3;
  const ShootingProblem problem(
      model, FreeFrom(model, {{"link1.length", 0.6}}),
      {Simulate(model, RandomState(model, 0.5, 1), simulation)},
      EstimationOptions());
  const Solved solved = FindSolver("lm").solve(problem, {});
  EXPECT_TRUE(solved.fit.converged);
  EXPECT_EQ(solved.fit.solver, "lm");
  EXPECT_FALSE(solved.mixture);
  EXPECT_LT(std::abs(Deviation(solved.fit, {"link1.length", 0.5})), 5.0);
}

}  // namespace
}  // namespace sysid
