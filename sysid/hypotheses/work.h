#pragma once

#include <algorithm>
#include <cmath>

#include "sysid/estimation/fit.h"
#include "sysid/hypotheses/constants.h"

namespace sysid::hypotheses {

// What rolling out so many samples costs, with derivatives by these columns, in
// samples that are rolled out by one step without any. Counted, not timed: what
// is asked may not hang on how busy a machine is.
inline double Work(double samples, double evaluations, double columns) {
  // Of the evaluations of a Levenberg-Marquardt step about every other asks for
  // derivatives.
  constexpr double kWithColumns = 0.5;
  return samples * evaluations * (1.0 + kWithColumns * kColumnWork * columns);
}

// That of a fit: its rollouts alone.
inline double EstimationWork(const Fit& fit, const ShootingProblem& problem) {
  const double period = problem.data().MedianSamplePeriod();
  const double steps =
      fit.step_s > 0.0 ? std::max(1.0, std::ceil(period / fit.step_s - 1e-6))
                       : 1.0;
  return steps * Work(fit.samples, fit.evaluations,
                      problem.map().size() + problem.model().tangent_size());
}

}  // namespace sysid::hypotheses
