#pragma once

#include <string>

#include "sysid/estimation/shooting_problem.h"
#include "sysid/estimation/shooting_segment.h"

namespace sysid {

// What makes a fit hopeless before it starts, in words, else "": a start that
// is no possible body, a joint that cannot move, no parameter that
// changes a residual (by name). `segments` are those of the point's cut: what
// they are linearised for here a first stage need not do again.
std::string WhyHopeless(const ShootingProblem& problem, const Solution& point,
                        ShootingSegments* segments);

}  // namespace sysid
