#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "sysid/estimation/fit.h"
#include "sysid/stochastic/adam.h"
#include "sysid/stochastic/gaussian_mixture.h"

namespace sysid {

// The estimators of Heiden et al., "Real2Sim Transfer using Differentiable
// Physics", on a shooting problem (docs/stochastic.md). Both minimise (9.1)
// over rollouts whose first states are given, from the data: of whole runs, or
// of segments where EstimationOptions::segment says how long. Neither throws
// for numerics: Fit::converged and termination say what happened.
//
// The Fit that they return is Levenberg-Marquardt's: its intervals and what it
// calls unidentifiable come from the Jacobian at the estimate with the states
// eliminated, (6.2), not from the path that led there; what the mixture's
// kernels disagree in is unidentifiable too. `cost` of its history is
// N L / (2 noise^2).

struct AdamFitOptions {
  AdamOptions adam;
  // d of (9.1): rad (m); infinity: squares.
  double huber = std::numeric_limits<double>::infinity();
  // Rollouts start at rest: a velocity that the data only tells roughly is
  // known to be zero.
  bool from_rest = false;
};

// Deterministic: equation 1.
Fit FitAdam(const ShootingProblem& problem, const AdamFitOptions& options);

struct MixtureEpoch {
  int epoch = 0;
  int rollouts = 0;   // that had arrived
  double loss = 0.0;  // mean over the draws
  ParameterMixture kernels;
};

struct MixtureOptions : AdamFitOptions {
  int kernels = 3;
  int draws = 16;                  // an epoch
  double temperature = 2.0 / 3.0;  // of the Gumbel-Softmax
  // Deviation of the kernels at the start, and of their means about it, in
  // units of v: parts of a parameter's size.
  double spread = 0.3;
  // Rollouts arrive in this many portions, each followed by as many epochs on
  // all that has arrived; then adam.epochs does not count.
  bool online = false;
  int online_samples = 10;
  int online_epochs = 15;
  std::uint64_t seed = 1;

  MixtureOptions() { huber = 0.1; }
  int epochs() const {
    return online ? online_samples * online_epochs : adam.epochs;
  }
};

struct MixtureFit {
  Fit fit;  // at mixture.Mean()
  ParameterMixture mixture;
  GaussianMixture kernels;           // the same over v, to sample from
  std::vector<MixtureEpoch> epochs;  // the start, then after each epoch
  int draws = 0, failed_draws = 0;
  int clipped_epochs = 0;  // whose gradient was far larger than the others'
  // Draws that would have been outside of their bounds, had the kernels been
  // Gaussian in the parameters themselves.
  int beyond_bounds = 0;
  // In sentences: runs that were cut, failed draws, collapse, kernels that
  // disagree.
  std::vector<std::string> remarks;
  // Parameters in which the kernels ended apart though they fit equally well:
  // fit.not_identifiable names them, too.
  std::vector<std::string> disagreeing;

  explicit MixtureFit(const Fit& f) : fit(f) {}
};

MixtureFit FitGaussianMixture(const ShootingProblem& problem,
                              const MixtureOptions& options);

// Draws from the mixture: parameter values, count x n, all within bounds.
Eigen::MatrixXd SampleParameters(const ShootingProblem& problem,
                                 const GaussianMixture& kernels, int count,
                                 std::uint64_t seed);

}  // namespace sysid
