#pragma once

#include "sysid/stochastic/gaussian_mixture.h"
#include "sysid/stochastic/transformation.h"

namespace sysid {

// A mixture over the parameters' values, in their units: weights K, means and
// standard deviations K x n.
struct ParameterMixture {
  Eigen::VectorXd weights;
  Eigen::MatrixXd means, stds;

  // The weighted sum of the kernels' means: what the mixture estimates.
  Eigen::VectorXd Mean() const;
  // Standard deviations of all kernels together.
  Eigen::VectorXd Std() const;
};

// Moments of each kernel of a mixture over v when carried to the parameters:
// of theta = T(v) by quadrature, exact to rounding for the deviations that
// occur; entries of an inertia that theta holds by (4.1) to first order.
ParameterMixture InParameters(const ShootingProblem& problem,
                              const Transformation& transformation,
                              const GaussianMixture& mixture);

}  // namespace sysid
