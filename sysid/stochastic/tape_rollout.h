#pragma once

#include "residuals/segment.h"

// Stan's scalar by its name alone, so that this header does not see Stan.
namespace stan {
namespace math {
class var;
}  // namespace math
}  // namespace stan

namespace sysid {

// The rollout from x0 on the calling thread's tape: errors(theta). False where
// the dynamics fail.
bool RollOutOnTape(const SegmentRollout& rollout, const double* x0,
                   const stan::math::var* theta, stan::math::var* errors);

}  // namespace sysid
