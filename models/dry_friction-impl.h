#pragma once

#include <cmath>

#include "models/dry_friction.h"
#include "models/motion-impl.h"

// Definitions of dry_friction.h, and the modes as the steps need them. Equation
// numbers: docs/dry_friction.md.

namespace sysid {
namespace internal {

// s of (1).
inline double SignOf(DryMode mode) {
  return mode == DryMode::kForward    ? 1.0
         : mode == DryMode::kBackward ? -1.0
                                      : 0.0;
}
inline DryMode Slipping(double sign) {
  return sign > 0 ? DryMode::kForward : DryMode::kBackward;
}

// c(0) of a body's joint, all its dry friction together and, projected, that of
// its followers; under the efforts and inputs of the last evaluation.
template <typename T>
double LevelAtRest(const Workspace<T>& ws, int body) {
  double level = 0.0;
  for (const auto& effect : ws.effort_effects) {
    if (!effect.dry) continue;
    const Body& own = ws.model().bodies()[effect.body];
    if ((own.leader < 0 ? effect.body : own.leader) != body) continue;
    level += std::abs(own.multiplier) *
             ValueOf(effect.hooks->DryFriction(RestingJoint(ws, effect),
                                               effect.p, T(0.0)));
  }
  return level;
}

template <typename T>
void ForgetModes(Workspace<T>* ws) {
  for (const int i : ws->dry_bodies) ws->bodies[i].dry = DryMode::kSmoothed;
}

// The modes of the joints that move; true where all do.
template <typename T>
bool TakeSigns(Workspace<T>* ws, const T* qd) {
  bool all = true;
  for (const int i : ws->dry_bodies) {
    const double rate = ValueOf(qd[ws->model().bodies()[i].v_index]);
    if (rate == 0.0) all = false;
    ws->bodies[i].dry = Slipping(rate);
  }
  return all;
}

// By how much a joint with qd = 0 breaks (3), as a force: more than 0 where its
// mode is wrong. `better`: the mode to try instead.
template <typename T>
double Violation(const Workspace<T>& ws, int i, const T* qdd, DryMode* better) {
  const BodyData<T>& b = ws.bodies[i];
  const double level = LevelAtRest(ws, i);
  if (b.dry == DryMode::kRests) {
    const double driven = ValueOf(b.u);  // -lambda
    *better = Slipping(driven);
    return std::abs(driven) - level;
  }
  const double rate = ValueOf(qdd[ws.model().bodies()[i].v_index]);
  const double force = rate / ValueOf(b.D_inverse);
  if (b.dry == DryMode::kSmoothed) {
    *better = Slipping(rate);
    return std::abs(force);
  }
  const double s = SignOf(b.dry);
  *better = level > 0.0 ? DryMode::kRests : Slipping(-s);
  return -s * force;
}

// Sets the modes of all joints at a state, and qdd by them: (3) by principal
// pivoting. All with qd = 0 rest at first; what breaks (3) most is changed
// until nothing does. Where that takes long, the first instead of the worst,
// which cannot cycle (Murty 1974), and after kMostPivots the modes stay as they
// are: a joint is then held, or let go, that should not, for a step at most. A
// joint of no level (a candidate that is off) never rests: nothing would hold
// it.
template <typename T>
bool DecideModes(Workspace<T>* ws, const T* q, const T* qd, const T* held,
                 T* qdd) {
  constexpr int kMostPivots = 64;
  Hold(ws, q, qd, held);
  const auto rate = [&](int i) {
    return ValueOf(qd[ws->model().bodies()[i].v_index]);
  };
  const int worst_first = 2 * static_cast<int>(ws->dry_bodies.size()) + 2;
  if (!TakeSigns(ws, qd)) {
    for (const int i : ws->dry_bodies) {
      if (rate(i) != 0.0) continue;
      ws->bodies[i].dry =
          LevelAtRest(*ws, i) > 0.0 ? DryMode::kRests : DryMode::kSmoothed;
    }
  }
  for (int pivot = 0;; ++pivot) {
    if (!ForwardDynamics<T>(ws, q, qd, held, qdd)) return false;
    int wrong = -1;
    double most = 0.0;
    DryMode mode = DryMode::kSmoothed;
    for (const int i : ws->dry_bodies) {
      DryMode better;
      if (rate(i) != 0.0) continue;
      const double violation = Violation(*ws, i, qdd, &better);
      if (!(violation > most)) continue;
      wrong = i;
      most = violation;
      mode = better;
      if (pivot >= worst_first) break;
    }
    if (wrong < 0 || pivot == kMostPivots) return true;
    ws->bodies[wrong].dry = mode;
  }
}

}  // namespace internal

template <typename T>
bool RestOrSlip(Workspace<T>* ws, const T* q, const T* qd, const T* held,
                T* qdd) {
  const bool ok = internal::DecideModes(ws, q, qd, held, qdd);
  internal::ForgetModes(ws);
  return ok;
}

}  // namespace sysid
