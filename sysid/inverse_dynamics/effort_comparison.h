#pragma once

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
  std::vector<bool> tells;  // not where the joint may rest: is not counted
};

struct EffortComparison {
  double cut_off_hz = 0.0;           // of the filter
  Eigen::VectorXd left;              // rms over all runs, nv
  std::vector<EffortError> errors;   // the same, where efforts were measured
  std::vector<EffortSeries> series;  // by joint, then by run
};

// Of the model with the parameters theta, of joints whose effort was measured.
// Empty where a joint's position was not.
EffortComparison CompareEfforts(const ShootingProblem& problem,
                                const Eigen::VectorXd& theta);

// The same of runs that are sampled already.
EffortComparison CompareEfforts(const Model& model,
                                const std::vector<const Run*>& runs,
                                const std::vector<SampledMotion>& sampled,
                                const MechanismParameters<double>& values);

}  // namespace sysid
