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

// Where the motors of a state's joints are and how they move, on the joints'
// side of their gears: q, qd and qdd (nq, nv and nv numbers) come as those of
// the joints, z_rate (nz numbers) as scratch, zero where no sensor reads rates.
// Right after the dynamics where one does.
template <typename T>
void ToMotors(const Workspace<T>& ws, const T* x, T* z_rate, T* q, T* qd,
              T* qdd) {
  if (ws.motor_effects.empty()) return;
  const StateLayout& at = ws.model().layout();
  if (ws.sensors_read_rates) {
    StateRates<T>(ws, x + at.q(), x + at.qd(), z_rate);
  }
  for (const auto& effect : ws.motor_effects) {
    const Body& body = ws.model().bodies()[effect.body];
    effect.hooks->ToMotor(x + at.z() + effect.first_z, z_rate + effect.first_z,
                          effect.p, q + body.q_index, qd + body.v_index,
                          qdd + body.v_index);
  }
}

// z of the state x as it starts (StartStates).
template <typename T>
void StartStatesAt(Workspace<T>* ws, const T* held, T* x) {
  const StateLayout& at = ws->model().layout();
  std::fill_n(x + at.z(), at.nz(), T(0.0));
  ws->z = nullptr;
  Hold<T>(ws, x + at.q(), x + at.qd(), held);
  for (const auto& effect : ws->state_effects) {
    effect.hooks->StartState(JointOf(*ws, effect, x + at.q(), x + at.qd()),
                             effect.p, x + at.z() + effect.first_z);
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

// The same of a whole step: z of `to` that a way says comes as that of `from`.
template <typename T>
void MoveStatesFrom(const Workspace<T>& ws, const T* from, T* to) {
  for (const auto& effect : ws.state_effects) {
    if (!effect.moves) continue;
    const int first = ws.model().layout().z() + effect.first_z;
    std::copy_n(from + first, effect.states, to + first);
  }
  MoveStatesAlong<T>(ws, from, to);
}

}  // namespace internal
}  // namespace sysid
