#pragma once

#include <cstddef>

#include "sysid/stochastic/rollouts.h"
#include "sysid/stochastic/transformation.h"

namespace sysid {

// Gradients by reverse mode: transformation and loss are on Stan Math's tape,
// the sum of (9.1) as one node whose partial derivatives are RolloutSums'. No
// header here sees Stan.

// Whether this build has Stan Math. Without it the functions below abort.
bool HaveStanMath();
// How to get it, for messages.
inline constexpr char kStanMathHint[] =
    "it needs Stan Math: apt-get install --no-install-recommends "
    "r-cran-stanheaders libboost-dev, then configure and build again";

// The mean of L(T(v)), (9.1), over the rows v of `points` (9.5), and its
// derivatives by each of them; L over the first `count` rollouts. A row whose
// dynamics fail is left out of the mean and counted, and its derivatives are
// zero; false where all do, or where a derivative is not finite. `sums` keeps
// memory for the next call.
bool MeanLossGradient(const Rollouts& rollouts, int count,
                      const Transformation& transformation, double huber,
                      const RowMatrixXd& points, RolloutSums* sums,
                      double* loss, int* failed, Eigen::ArrayXXd* gradient);

// The tape's memory. It is recovered after every call above: nothing is left on
// it, and what it holds grows to what one call needs and no further.
struct TapeUse {
  std::size_t last_call = 0;   // bytes that the last call had on it at its end
  std::size_t nodes_left = 0;  // after it
};
TapeUse LastTapeUse();

}  // namespace sysid
