#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/stepper-impl.h"

// Steps of a model with dry friction: Runge and Kutta's, cut where a joint
// stops or breaks away. Included by stepper-impl.h. Equation numbers:
// docs/dry_friction.md.

namespace sysid {
namespace internal {

// Of a step, before the rest of it is taken in one, without looking.
inline constexpr int kMostEvents = 32;
// To find the first of them.
inline constexpr int kMostTries = 32;

// a + b t + c t^2 + d t^3, t in parts of a step.
struct Cubic {
  double a, b, c, d;

  // Through values at both ends, with these derivatives there.
  static Cubic Hermite(double y0, double y1, double slope0, double slope1) {
    return {y0, slope0, 3.0 * (y1 - y0) - 2.0 * slope0 - slope1,
            2.0 * (y0 - y1) + slope0 + slope1};
  }
  // Through values at 0, 1/2 and 1.
  static Cubic Parabola(double y0, double middle, double y1) {
    const double c = 2.0 * (y0 + y1 - 2.0 * middle);
    return {y0, y1 - y0 - c, c, 0.0};
  }
  double operator()(double t) const { return a + t * (b + t * (c + t * d)); }
  double Slope(double t) const { return b + t * (2.0 * c + t * 3.0 * d); }

  // Where it turns upwards between 0 and 1, if it falls first; else 1.
  double Valley() const {
    if (!(b < 0.0 && Slope(1.0) > 0.0)) return 1.0;
    double low = 0.0, high = 1.0;
    for (int i = 0; i < 40; ++i) {
      const double t = 0.5 * (low + high);
      (Slope(t) < 0.0 ? low : high) = t;
    }
    return 0.5 * (low + high);
  }

  // Where it becomes negative, by halving: it is at `until`. One that starts at
  // 0 is divided by t; where it does not rise it is negative from the start.
  double FirstRoot(double until) const {
    const bool at_zero = !(a > 0.0);
    if (at_zero && !(b > 0.0)) return 0.0;
    double low = 0.0, high = until;
    for (int i = 0; i < 50; ++i) {
      const double t = 0.5 * (low + high);
      const double y = at_zero ? b + t * (c + t * d) : (*this)(t);
      (y > 0.0 ? low : high) = t;
    }
    return 0.5 * (low + high);
  }
};

}  // namespace internal

template <typename T>
template <class Companion>
struct Stepper<T>::Watch {
  Stepper* stepper;
  Companion* companion;
  int stage = 0;

  void Accelerated(const T* q, const T* qd, const T* qdd) {
    stepper->Record(stage++, qd, qdd);
    companion->Accelerated(q, qd, qdd);
  }
  void MovedStage(int from, double h, const T* u, const T* qd) {
    if (from < 3) companion->MovedStage(from, h, u, qd);
  }
};

template <typename T>
template <class Companion>
bool Stepper<T>::StepDry(double h, const T* held, T* x, Companion* companion) {
  const int nv = ws_->model().nv();
  end_x_.resize(ws_->model().state_size());
  first_qdd_.resize(nv);
  before_qdd_.resize(nv);
  jump_.resize(nv);
  dry_.resize(ws_->dry_bodies.size());
  const StateLayout& at = ws_->model().layout();
  SeeStates(x);
  internal::Hold<T>(ws_, x + at.q(), x + at.qd(), held);
  for (size_t i = 0; i < dry_.size(); ++i) {
    dry_[i].body = ws_->dry_bodies[i];
    dry_[i].v = ws_->model().bodies()[dry_[i].body].v_index;
    std::fill_n(dry_[i].level, 4, internal::LevelAtRest(*ws_, dry_[i].body));
  }
  bool ok = true;
  double left = h;
  for (int event = 0; ok && left > 0.0; ++event) {
    ok = StepToEvent(event < internal::kMostEvents, held, x, &left, companion);
  }
  internal::ForgetModes(ws_);
  return ok;
}

// Takes x to the next event within `left` seconds and over it, or to their end;
// takes from `left` what has passed. Where it does not look, to the end.
template <typename T>
template <class Companion>
bool Stepper<T>::StepToEvent(bool look, const T* held, T* x, double* left,
                             Companion* companion) {
  bool started;
  if (!Start(held, x, &started, companion)) return false;
  double h = *left;
  int first = -1;    // the joint whose event is at h
  bool cut = false;  // h is less than what is left
  for (int tries = 0;; ++tries) {
    Watch<Companion> watch{this, companion};
    const bool look_on = look && tries < internal::kMostTries;
    const bool ok = StepRungeKutta4(h, held, x, end_x_.data(), &watch, started);
    started = false;
    if (!ok && !look_on) return false;
    // What friction alone stops long before h, it has taken far beyond.
    const double sensible = look_on ? SensibleStep(ok ? h : 0.25 * h) : h;
    if (sensible < h) {
      cut = true;
      first = -1;
      h = sensible;
      continue;
    }
    // Of another joint, before h.
    const Event event = look_on ? NextEvent(h) : Event();
    if (event.joint < 0) break;
    bool located;
    Locate(event, held, x, &h, &located);
    if (located) {
      cut = true;
      first = event.joint;
      for (DryJoint& joint : dry_) joint.passed = false;
    }
    dry_[event.joint].passed = true;
  }
  const StateLayout& at = ws_->model().layout();
  companion->MovedStage(3, h, u_.data(), stage_x_.data() + at.qd());
  std::copy(end_x_.begin(), end_x_.end(), x);
  *left = cut ? *left - h : 0.0;
  if (first < 0) return true;
  const int body = dry_[first].body;
  // What breaks away is let go by the next Start: its force is above its level.
  return ws_->bodies[body].dry == DryMode::kRests ||
         Stop(body, held, x, companion);
}

// Decides who rests. `started`: the dynamics at x are in the workspace.
template <typename T>
template <class Companion>
bool Stepper<T>::Start(const T* held, T* x, bool* started,
                       Companion* companion) {
  const StateLayout& at = ws_->model().layout();
  const T *q = x + at.q(), *qd = x + at.qd();
  SeeStates(x);
  for (DryJoint& joint : dry_) joint.passed = joint.settles = false;
  *started = false;
  if (internal::TakeSigns(ws_, qd)) return true;
  if (!internal::DecideModes(ws_, q, qd, held, qdd_.data())) return false;
  *started = true;
  // One whose qd = 0 still has a derivative stops here, (5): as if it came
  // slipping, one after the other; against what holds it, so that its
  // acceleration is not zero.
  for (DryJoint& joint : dry_) {
    BodyData<T>& b = ws_->bodies[joint.body];
    joint.settles = b.dry == DryMode::kRests &&
                    (MayMove(qd[joint.v]) || companion->Moves(joint.v));
    if (!joint.settles) continue;
    b.dry = internal::Slipping(-ValueOf(b.u));
    *started = false;
  }
  if (*started) return true;
  if (!ForwardDynamics<T>(ws_, q, qd, held, qdd_.data())) return false;
  for (const DryJoint& joint : dry_) {
    if (!joint.settles) continue;
    before_qdd_ = qdd_;
    ws_->bodies[joint.body].dry = DryMode::kRests;
    if (!ForwardDynamics<T>(ws_, q, qd, held, qdd_.data())) return false;
    Jump(joint.body, x, companion);
  }
  return true;
}

// A slipping joint has come to qd = 0: it rests or turns back, and with it
// others may move that rested.
template <typename T>
template <class Companion>
bool Stepper<T>::Stop(int body, const T* held, T* x, Companion* companion) {
  const StateLayout& at = ws_->model().layout();
  const T *q = x + at.q(), *qd = x + at.qd();
  SeeStates(x);
  if (!ForwardDynamics<T>(ws_, q, qd, held, before_qdd_.data())) return false;
  T& rate = x[at.qd() + ws_->model().bodies()[body].v_index];
  rate -= T(ValueOf(rate));  // to the last bit; its derivative stays
  if (!internal::DecideModes(ws_, q, qd, held, qdd_.data())) return false;
  Jump(body, x, companion);
  return true;
}

// (5), from before_qdd_ to qdd_.
template <typename T>
template <class Companion>
void Stepper<T>::Jump(int body, T* x, Companion* companion) {
  const StateLayout& at = ws_->model().layout();
  const int v = ws_->model().bodies()[body].v_index;
  const bool rests = ws_->bodies[body].dry == DryMode::kRests;
  const double rate = ValueOf(before_qdd_[v]);
  for (int i = 0; i < at.nv(); ++i) {
    jump_[i] = (ValueOf(qdd_[i]) - ValueOf(before_qdd_[i])) / rate;
    // It only grazes 0: there is no derivative.
    if (!std::isfinite(jump_[i])) jump_[i] = 0.0;
  }
  T* qd = x + at.qd();
  const T moved = qd[v];
  if (MayMove(moved)) {
    for (int i = 0; i < at.nv(); ++i) qd[i] += moved * jump_[i];
  }
  if (rests) qd[v] = T(0.0);
  companion->Jumped(v, jump_.data(), rests);
}

template <typename T>
void Stepper<T>::Record(int stage, const T* qd, const T* qdd) {
  if (stage == 0) std::copy_n(qdd, first_qdd_.size(), first_qdd_.begin());
  for (DryJoint& joint : dry_) {
    const BodyData<T>& b = ws_->bodies[joint.body];
    if (stage == 0) joint.rate = ValueOf(qd[joint.v]);
    if (!ws_->drive.empty()) {
      joint.level[stage] = internal::LevelAtRest(*ws_, joint.body);
    }
    joint.drive[stage] = ValueOf(b.dry == DryMode::kRests ? b.u : qdd[joint.v]);
  }
}

// h, or less where a joint would stop much sooner at its first acceleration.
template <typename T>
double Stepper<T>::SensibleStep(double h) const {
  constexpr double kMuch = 8.0;
  for (const DryJoint& joint : dry_) {
    if (ws_->bodies[joint.body].dry == DryMode::kRests || joint.passed) {
      continue;
    }
    const double stops = -joint.rate / joint.drive[0];
    if (stops > 0.0 && kMuch * stops < h) h = 0.5 * kMuch * stops;
  }
  return h;
}

// The first event of those that have not passed, within the h seconds from x to
// end_x_, by interpolation of the stages.
template <typename T>
typename Stepper<T>::Event Stepper<T>::NextEvent(double h) const {
  using internal::Cubic;
  const int qd = ws_->model().layout().qd();
  Event next;
  for (size_t i = 0; i < dry_.size(); ++i) {
    const DryJoint& joint = dry_[i];
    const DryMode mode = ws_->bodies[joint.body].dry;
    if (joint.passed || mode == DryMode::kSmoothed) continue;
    Cubic margin;
    double until = 1.0;
    if (mode == DryMode::kRests) {
      const double middle = 0.5 * (joint.drive[1] + joint.drive[2]);
      const double middle_level = 0.5 * (joint.level[1] + joint.level[2]);
      const double end = joint.drive[3];
      if (!(std::abs(end) > joint.level[3])) {
        if (!(std::abs(middle) > middle_level)) continue;
        until = 0.5;
      }
      const double sign = (until == 1.0 ? end : middle) < 0.0 ? -1.0 : 1.0;
      margin = Cubic::Parabola(joint.level[0] - sign * joint.drive[0],
                               middle_level - sign * middle,
                               joint.level[3] - sign * end);
    } else {
      const double s = internal::SignOf(mode);
      const double end = s * ValueOf(end_x_[qd + joint.v]);
      margin = Cubic::Hermite(s * joint.rate, end, s * joint.drive[0] * h,
                              s * joint.drive[3] * h);
      if (!(end < 0.0)) {
        until = margin.Valley();
        if (until == 1.0 || !(margin(until) < 0.0)) continue;
      }
    }
    const double guess = margin.FirstRoot(until);
    if (next.joint >= 0 && !(guess < next.guess)) continue;
    next = {static_cast<int>(i), guess, margin.Slope(guess), until};
  }
  return next;
}

// The margin (4) of a joint h seconds after x, in the modes that are. False
// where the dynamics fail.
template <typename T>
bool Stepper<T>::Margin(const DryJoint& joint, double h, const T* held,
                        const T* x, double* margin) {
  const StateLayout& at = ws_->model().layout();
  const DryMode mode = ws_->bodies[joint.body].dry;
  internal::NoCompanion alone;
  std::copy(first_qdd_.begin(), first_qdd_.end(), qdd_.begin());
  if (at.nz() > 0) internal::Hold<T>(ws_, x + at.q(), x + at.qd(), held);
  if (!StepRungeKutta4(h, held, x, end_x_.data(), &alone, true)) return false;
  const T* qd = end_x_.data() + at.qd();
  SeeStates(end_x_.data());
  if (mode != DryMode::kRests) {
    *margin = internal::SignOf(mode) * ValueOf(qd[joint.v]);
    return true;
  }
  if (!ForwardDynamics<T>(ws_, end_x_.data() + at.q(), qd, held, qdd_.data())) {
    return false;
  }
  const double level = ws_->drive.empty()
                           ? joint.level[0]
                           : internal::LevelAtRest(*ws_, joint.body);
  *margin = level - std::abs(ValueOf(ws_->bodies[joint.body].u));
  return true;
}

// h until the event, from a step of h seconds in which it is. Not located:
// only the interpolant passes 0. A joint that stops does so to rounding; one
// that breaks away is a little past its level, which lets it go.
template <typename T>
void Stepper<T>::Locate(const Event& event, const T* held, const T* x,
                        double* h, bool* located) {
  constexpr int kMostTries = 80;
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  constexpr double kPast = 1e-9;  // of the level: a second-order matter
  const DryJoint& joint = dry_[event.joint];
  const bool rests = ws_->bodies[joint.body].dry == DryMode::kRests;
  double low = 0.0, high = event.until * *h, margin = 0.0;
  *located = true;
  if (rests || event.until < 1.0) {
    *located = Margin(joint, high, held, x, &margin) && margin < 0.0;
    if (!*located) return;
  }
  const double wanted = rests ? -0.5 * kPast * joint.level[0] : 0.0;
  const double near =
      rests ? -wanted
            : 4.0 * kEpsilon *
                  (std::abs(joint.rate) + *h * std::abs(joint.drive[0]));
  double at = event.guess * *h, slope = event.slope / *h;
  double last_at = 0.0, last_margin = 0.0;
  for (int i = 0; i < kMostTries && high - low > 2.0 * kEpsilon * high; ++i) {
    if (!Margin(joint, at, held, x, &margin)) {
      high = at;
      at = 0.5 * (low + high);
      continue;
    }
    if (std::abs(margin - wanted) <= near) {
      high = at;
      break;
    }
    (margin > wanted ? low : high) = at;
    if (i > 0) slope = (margin - last_margin) / (at - last_at);
    last_at = at;
    last_margin = margin;
    at -= (margin - wanted) / slope;
    // Halved now and then, should secants creep.
    if (!(at > low && at < high) || i % 8 == 7) at = 0.5 * (low + high);
  }
  *h = high;
}

}  // namespace sysid
