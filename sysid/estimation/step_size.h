#pragma once

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// The integrator and the step that a fit needs.

// The problem's integrator with the longest step, of the median sample period
// over 1, 2, 4, ..., with which rolling the point's segments out differs from
// half that step by less than `step_error` standard deviations (rms of the
// worst segment: of its measurements, and of the state at its end), 1/64 at the
// shortest; and shorter where the effects' damping needs it to stay stable.
//
// Where that keeps Runge and Kutta's step below the sample period, and the
// options leave the choice, Rosenbrock's (docs/theory.md (3.8)) with the step
// that it needs by the same rule, if it asks for fewer evaluations. Not for dry
// friction of hinges and slides, which it would smooth.
RolloutOptions ChooseRollout(const ShootingProblem& problem,
                             const Solution& point, double step_error);

// Such a rollout that the effects may also grow on the way to the solution: its
// step is the shorter of ChooseRollout's, and of that which stays stable
// (within kStableError) with the effects' parameters doubled and at least of
// their typical size. A stiff damping that a step cannot follow makes rollouts
// fail, and a fit that starts from none of it would never get there.
inline constexpr double kStableError = 100.0;
RolloutOptions ChooseRolloutAhead(const ShootingProblem& problem,
                                  const Solution& point);

// Gives the solution the rollout that it and the way ahead of it need, where it
// has none or its step is too long by far. True where it changed.
bool AdaptRollout(const ShootingProblem& problem, Solution* solution);

// The step of the solution, halved until theta does not depend on it: until the
// change of the residuals that another halving makes moves theta, by the
// linearised problem, less than kStepBias standard errors. (ChooseRollout sees
// one segment at a time; along a whole run its small errors add up, most of all
// those of dry friction, whose kinks the steps pass over.) A first-order step
// never gets there and is left as it is.
double RefineStep(const ShootingProblem& problem, double defect,
                  const Solution& point);

}  // namespace sysid
