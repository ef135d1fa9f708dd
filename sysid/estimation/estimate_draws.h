#pragma once

#include <cstdint>
#include <string>

#include "sysid/estimation/estimates.h"

namespace sysid {

// Draws from the distribution of an estimate: theta is normal with the estimate
// as mean and the covariance C of the fit, given that the values are within
// their bounds and the bodies possible (draws that are not are drawn again).
// With S the standard deviations of theta and z standard normal,
//
//   theta = estimate + S (S^-1 C S^-1)^(1/2) z                         (6.11)
//
// where the symmetric square root is unique, so that draws derive from the seed
// alone. Theta does not move along what the data do not determine, nor do
// parameters that the fit holds at a bound. Of the directions of theta / size
// (ThetaScale) in which parameters take part that are not identifiable, those
// with a standard deviation above 1 count as not determined.
struct EstimateDraws {
  Eigen::MatrixXd values;  // a row a draw, a column a parameter
  std::string failure;     // why there are none, else empty
};

EstimateDraws DrawFromEstimate(const ShootingProblem& problem,
                               const Eigen::VectorXd& theta,
                               const Estimates& estimates, int count,
                               std::uint64_t seed);

}  // namespace sysid
