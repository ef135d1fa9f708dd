#pragma once

#include "models/dynamics.h"

namespace sysid {

// Dry friction that sticks, of hinges and slides: docs/dry_friction.md derives
// it. A joint with the level c(|qd|) slips with the sign s and feels
// -s c(s qd), or rests by the force lambda that this needs, |lambda| <= c(0).

// As ForwardDynamics, but which of the joints with dry friction and qd = 0 rest
// and which are about to slip is decided, and those that slip feel the law
// itself. (ForwardDynamics alone takes it smoothed.)
template <typename T>
[[nodiscard]] bool RestOrSlip(Workspace<T>* ws, const T* q, const T* qd,
                              const T* held, T* qdd);

}  // namespace sysid
