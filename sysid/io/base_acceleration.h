#pragma once

#include <vector>

#include "residuals/run.h"

namespace sysid {

// The second derivative, at each time, of the natural cubic spline through
// values: the curve through them that bends least. Linear between the times, as
// inputs are (Input::held), it leads back through the values exactly.
std::vector<double> SplineAcceleration(const std::vector<double>& t,
                                       const std::vector<double>& values);

// The acceleration base.ax, .. of a run that has the position base.px, .. of
// the base along some axis and not its acceleration; along axes without either
// the base rests. Of a run that has neither nothing.
void AddBaseAcceleration(Run* run);

}  // namespace sysid
