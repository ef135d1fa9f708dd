#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sysid/estimation/fit.h"
#include "sysid/inverse_dynamics/equation_rows.h"

namespace sysid {

// Measured efforts beside those that the measured motion needs of a model, by
// the equations of motion, (11.2): what an owner of an arm looks at first. Both
// are filtered alike.
struct EffortSeries {
  std::string run, joint;  // "shoulder.x" of a spherical one
  std::string unit;        // N m or N
  std::vector<double> t;   // s
  std::vector<double> measured, predicted;
};

struct EffortComparison {
  double cut_off_hz = 0.0;           // of the filter
  std::vector<EffortError> errors;   // where efforts were measured
  std::vector<EffortSeries> series;  // by joint, then by run
};

// Whether every run, of all processes, measures the position of every joint.
bool MeasuresAllJoints(const ShootingProblem& problem);

// Of the model with the parameters theta, of joints whose effort was measured.
// Empty where a joint's position was not. Of several processes each knows the
// series of its own runs; all else is of all runs.
EffortComparison CompareEfforts(const ShootingProblem& problem,
                                const Eigen::VectorXd& theta);

// The same by the equations of each run, without derivatives. They are asked
// for by several threads, and only the series are kept of them.
EffortComparison CompareEffortsBy(
    const ShootingProblem& problem,
    const std::function<EquationRows(int run)>& equations);

}  // namespace sysid
