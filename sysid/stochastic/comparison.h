#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sysid/stochastic/solvers.h"

namespace sysid {

// Levenberg-Marquardt, Adam and the mixture on the same problem from the same
// start.

struct ComparisonOptions : SolverOptions {
  // Values of the free parameters that are known to be right, if so: distances
  // are to these, else to what Levenberg-Marquardt determines.
  std::optional<Eigen::VectorXd> truth;
  // Further starts, drawn about the given one with this deviation (parts of a
  // parameter's size), each with a seed of its own for the mixture.
  int repeat = 1;
  double start_spread = 0.2;
  // That share out the starts; the first one has the given start.
  const Processes* helpers = &Alone();
};

// Where a solver was after an iteration (an epoch).
struct PathPoint {
  int iteration = 0;
  double time_s = 0.0;
  // (9.1) with squares over whole runs (or segments, where they were given),
  // from first states that are given: the same measure for all solvers, though
  // Levenberg-Marquardt minimises another.
  double loss = 0.0;
  Eigen::VectorXd values;
};

// From which iteration on the loss stays within this part of its last value.
inline constexpr double kSettled = 0.1;

struct SolverRun : Solved {
  std::string solver;  // one of Solvers()
  std::vector<PathPoint> path;
  int settled = 0;  // the iteration that kSettled means
  // The largest relative distance of a parameter from the reference, and that
  // parameter's name; NaN and "" without a reference.
  double distance = 0.0;
  std::string farthest;

  SolverRun(const std::string& name, Solved solved)
      : Solved(std::move(solved)), solver(name) {}
};

// What solvers say of how well a parameter is known, beside each other.
struct UncertaintyComparison {
  std::string parameter, unit;
  double lm_std = 0.0;       // NaN where the data does not determine it
  double mixture_std = 0.0;  // of all kernels together
  std::string why;           // they differ, in words
};

struct SolverTrial {
  bool converged = false;
  int iterations = 0, settled = 0, evaluations = 0;
  double time_s = 0.0, loss = 0.0, error = 0.0, distance = 0.0;
};

// One start.
struct ComparedStart {
  std::uint64_t seed = 1;
  Eigen::VectorXd start;
  std::vector<SolverTrial> solvers;  // in the order of Comparison::runs
};

// The likelihood of two parameters on a grid, states given:
// deviance = N (L - L_min) / noise^2 (over the reduced chi-square where that is
// above 1).
struct Landscape {
  Eigen::VectorXd x, y;      // values
  Eigen::MatrixXd deviance;  // y.size() x x.size()
  // The direction in which the loss is flattest at what Levenberg-Marquardt
  // found.
  Eigen::Vector2d valley = Eigen::Vector2d::Zero();
};

struct Comparison {
  std::vector<std::string> names, units;
  Eigen::VectorXd start;  // of all three: off the bounds
  // The truth, else what Levenberg-Marquardt found: NaN where the data does not
  // determine it, or where it did not converge.
  Eigen::VectorXd reference;
  bool reference_is_truth = false;
  RolloutOptions rollout;       // of the losses of the given start
  std::vector<SolverRun> runs;  // of the given start
  std::vector<UncertaintyComparison> uncertainty;
  std::vector<ComparedStart> trials;  // the given start first
  int asked = 1;  // starts; fewer trials: the others were interrupted
  std::optional<Landscape> landscape;         // of two parameters
  StoppedBy stopped_by = StoppedBy::kNobody;  // for who asks to stop to say
};

// The problem is not changed: each solver gets its own. Of several processes
// the first one has the whole comparison.
Comparison CompareSolvers(const ShootingProblem& problem,
                          const ComparisonOptions& options);

}  // namespace sysid
