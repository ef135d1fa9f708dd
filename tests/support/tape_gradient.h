#pragma once

#include <cstddef>

#include "sysid/stochastic/rollouts.h"
#include "sysid/stochastic/transformation.h"

namespace sysid {

// L(T(v)), (9.1), over all rollouts and its gradient by v, operation by
// operation on Stan Math's tape, the physics on the tape's own scalar: the
// reference that MeanLossGradient is compared with. Slow and large; knows the
// shipped effects only. False where the dynamics fail, or a derivative is not
// finite. `bytes`: what the tape held at the end.
bool LossGradientByTape(const Rollouts& rollouts,
                        const Transformation& transformation, double huber,
                        const Eigen::VectorXd& v, double* loss,
                        Eigen::VectorXd* gradient,
                        std::size_t* bytes = nullptr);

}  // namespace sysid
