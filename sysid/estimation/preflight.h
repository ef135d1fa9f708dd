#pragma once

#include <string>

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// What makes a fit hopeless before it starts, in words, else "": a start that
// is no possible body, a joint that cannot move, parameters that change no
// residual (by name).
std::string WhyHopeless(const ShootingProblem& problem,
                        const ShootingPoint& point);

}  // namespace sysid
