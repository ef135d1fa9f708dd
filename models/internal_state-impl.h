#pragma once

#include <algorithm>

#include "models/motion-impl.h"
#include "models/state_layout.h"

// How z moves in a step; see dynamics-impl.h.

namespace sysid {
namespace internal {

// The rates of z, nz numbers, right after the dynamics at q, qd and ws->z.
template <typename T>
void StateRates(const Workspace<T>& ws, const T* q, const T* qd, T* rate) {
  std::fill_n(rate, ws.model().layout().nz(), T(0.0));
  for (const auto& effect : ws.state_effects) {
    if (effect.moves) continue;
    effect.hooks->StateRate(JointOf(ws, effect, q, qd), effect.p,
                            rate + effect.first_z);
  }
}

// z of the state `to`, which comes with that of `from`, where the way between
// them says it (MoveState).
template <typename T>
void MoveStatesAlong(const Workspace<T>& ws, const T* from, T* to) {
  const StateLayout& at = ws.model().layout();
  for (const auto& effect : ws.state_effects) {
    if (!effect.moves) continue;
    const JointState<T> before =
        JointOf(ws, effect, from + at.q(), from + at.qd());
    const JointState<T> after = JointOf(ws, effect, to + at.q(), to + at.qd());
    effect.hooks->MoveState(before, after, effect.p,
                            to + at.z() + effect.first_z);
  }
}

}  // namespace internal
}  // namespace sysid
