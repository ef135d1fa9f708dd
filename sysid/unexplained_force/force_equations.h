#pragma once

#include "sysid/linearization/force_response.h"
#include "sysid/unexplained_force/smooth_force.h"

namespace sysid {

// The normal equations of forces at the knots of a linearised fit.
ForceEquations MakeForceEquations(const ForceResponse& response);

}  // namespace sysid
