#pragma once

namespace sysid {

// gamma of the Rosenbrock method ROS2 (Verwer et al. 1999), 1 - 1 / sqrt(2):
// with it the method is L-stable.
inline constexpr double kRosenbrockGamma = 0.29289321881345254;

}  // namespace sysid
