#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "sysid/stochastic/gaussian_mixture.h"
#include "sysid/stochastic/rollout_sums.h"
#include "sysid/stochastic/rollouts.h"
#include "sysid/stochastic/transformation.h"

namespace sysid {

// Losses and their gradients by reverse mode: transformation and loss are on
// Stan Math's tape. No header here sees Stan.

// How the rollout, errors r(theta), comes onto the tape.
enum class GradientWay {
  // As one node, the sum of (9.1), whose partial derivatives are RolloutSums'.
  kPrecomputed,
  // Operation by operation, the physics on the tape's own scalar. Slow and
  // large; the reference that the other way is compared with. Knows the shipped
  // effects only.
  kTape,
};

struct LossOptions {
  GradientWay way = GradientWay::kPrecomputed;
  // d of (9.1): rad (m); infinity: squares.
  double huber = std::numeric_limits<double>::infinity();
  int threads = 1;  // for the rollouts; the tape has one
};

// Whether this build has Stan Math. Without it the functions below abort.
bool HaveStanMath();
// How to get it, for messages.
const char* StanMathHint();

// L(T(v)) of (9.1) and its gradient by v. False where the dynamics of a rollout
// fail, or a derivative is not finite. `sums` keeps memory for the next call.
bool LossGradient(const Rollouts& rollouts, const std::vector<int>& which,
                  const Transformation& transformation,
                  const LossOptions& options, const Eigen::VectorXd& v,
                  double* loss, Eigen::VectorXd* gradient,
                  RolloutSums* sums = nullptr);

// (9.5): the mean of L(T(v)) over draws v of a mixture, and its gradient by
// GaussianMixture::Pack(). A draw whose dynamics fail is left out of the mean
// and counted; false where all do.
bool MixtureLossGradient(const Rollouts& rollouts,
                         const std::vector<int>& which,
                         const Transformation& transformation,
                         const LossOptions& options, const SoftDraws& draws,
                         double* loss, int* failed, Eigen::VectorXd* gradient,
                         RolloutSums* sums = nullptr);

// The tape's memory. It is recovered after every call above: nothing is left on
// it, and what it holds grows to what one call needs and no further.
struct TapeUse {
  std::size_t last_call = 0;   // bytes that the last call had on it at its end
  std::size_t nodes_left = 0;  // after it
};
TapeUse LastTapeUse();

}  // namespace sysid
