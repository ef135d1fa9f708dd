#pragma once

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "models/dry_friction-impl.h"
#include "models/followers-impl.h"
#include "models/internal_state-impl.h"
#include "models/math/rosenbrock.h"
#include "models/math/rotation.h"
#include "models/stepper.h"

// Definition of stepper.h's templates; included only where they are
// instantiated.

namespace sysid {
namespace internal {

// Of (3.3): how far ahead of the start each stage puts the next, in steps, and
// the stage's weight in the sums.
inline constexpr double kAhead[4] = {0.5, 0.5, 1.0, 0.0};
inline constexpr double kWeight[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};

// The largest eigenvalue of -(A + A^T) / 2, of nv columns; 0 where none is
// positive.
inline double FastestDecay(const Eigen::Matrix3d& A, int nv) {
  if (nv == 1) return std::max(0.0, -A(0, 0));
  const Eigen::Matrix3d S = -0.5 * (A + A.transpose());
  return std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(
                           S, Eigen::EigenvaluesOnly)
                           .eigenvalues()[2]);
}

// The tangent of q along the flow, given that q has moved by Exp(u) since the
// start of the step: (SO3.3) for spherical joints, qd itself for the others.
template <typename T>
void TangentRate(const Model& model, const T* u, const T* qd, T* rate) {
  for (const Body& body : model.movers()) {
    const int v = body.v_index;
    if (body.type == JointType::kSpherical) {
      const Vector3<T> out =
          RightJacobianInverse<T>(Vector3<T>(u[v], u[v + 1], u[v + 2]),
                                  Vector3<T>(qd[v], qd[v + 1], qd[v + 2]));
      for (int k = 0; k < 3; ++k) rate[v + k] = out[k];
    } else {
      rate[v] = qd[v];
    }
  }
}

// x moved along the flow: (q Exp(u), qd + v), u and v of nv numbers.
template <typename T>
void Advance(const Model& model, const T* x, const T* u, const T* v, T* out) {
  const StateLayout& at = model.layout();
  for (const Body& body : model.movers()) {
    const T* q = x + at.q(body);
    const T* u_i = u + body.v_index;
    T* q_out = out + at.q(body);
    if (body.type == JointType::kSpherical) {
      const Quaternion<T> moved =
          Multiply(Quaternion<T>(q[3], q[0], q[1], q[2]),
                   Exp<T>(Vector3<T>(u_i[0], u_i[1], u_i[2])));
      for (int k = 0; k < 4; ++k) q_out[k] = moved.coeffs()[k];
    } else {
      q_out[0] = q[0] + u_i[0];
    }
  }
  const T* qd = x + at.qd();
  T* qd_out = out + at.qd();
  for (int i = 0; i < at.nv(); ++i) qd_out[i] = qd[i] + v[i];
}

struct NoCompanion {
  template <typename T>
  void Accelerated(const T*, const T*, const T*) {}
  template <typename T>
  void Moved(double, const T*) {}
  template <typename T>
  void MovedStage(int, double, const T*, const T*) {}
  template <typename T>
  void MovedBraked(int, double, const T*, const T*) {}
  bool Moves(int) const { return false; }
  void Jumped(int, const double*, bool) {}
};

}  // namespace internal

template <typename T>
Stepper<T>::Stepper(Integrator integrator, Workspace<T>* workspace)
    : integrator_(integrator), ws_(workspace) {
  stage_x_.resize(ws_->model().state_size());
  for (std::vector<T>* part : {&u_, &v_, &rate_, &sum_u_, &sum_v_, &qdd_}) {
    part->resize(ws_->model().nv());
  }
  z_rate_.resize(ws_->model().layout().nz());
  sum_z_.resize(z_rate_.size());
  if (integrator_ != Integrator::kRosenbrock2) return;
  const Model& model = ws_->model();
  const EffectSet& effects = model.effects();
  for (int i = 0; i < effects.size(); ++i) {
    const Effect& effect = effects.effect(i);
    if (!(effect.hooks() & kEffortHook) || effect.ReadsMore()) continue;
    const int child = model.mechanism().joints[effect.joint()].child_link;
    dampers_.push_back({&HooksFor(effect, ScalarTag<Jet8>()),
                        model.placement(child).body,
                        effects.offset(i),
                        {}});
    dampers_.back().p.resize(effect.parameters().size());
  }
  by_qd_.resize(ws_->bodies.size());
  brake_.resize(ws_->tau.size());
  beside_.resize(ws_->tau.size());
  free_armature_.resize(ws_->bodies.size());
  had_armature_.resize(ws_->bodies.size());
}

template <typename T>
bool Stepper<T>::Step(double h, const T* held, T* x) {
  internal::NoCompanion alone;
  return StepWith(h, held, x, &alone);
}

template <typename T>
template <class Companion>
bool Stepper<T>::StepWith(double h, const T* held, T* x, Companion* companion) {
  bool ok = false;
  if (integrator_ == Integrator::kSemiImplicitEuler) {
    ok = StepEuler(h, held, x, companion);
  } else if (integrator_ == Integrator::kRosenbrock2) {
    ok = StepRosenbrock2(h, held, x, companion);
  } else if (ws_->dry_bodies.empty()) {
    ok = StepRungeKutta4(h, held, x, x, companion);
  } else {
    ok = StepDry(h, held, x, companion);
  }
  ws_->z = nullptr;
  return ok;
}

template <typename T>
void Stepper<T>::MoveStates(double h, const std::vector<T>& rate, const T* from,
                            T* to) {
  const StateLayout& at = ws_->model().layout();
  for (int i = 0; i < at.nz(); ++i) {
    to[at.z() + i] = from[at.z() + i] + rate[i] * h;
  }
  internal::MoveStatesAlong<T>(*ws_, from, to);
}

template <typename T>
template <class Companion>
bool Stepper<T>::StepEuler(double h, const T* held, T* x,
                           Companion* companion) {
  const Model& model = ws_->model();
  const StateLayout& at = model.layout();
  const T* qd = x + at.qd();
  SeeStates(x);
  if (!ForwardDynamics<T>(ws_, x + at.q(), qd, held, qdd_.data())) return false;
  companion->Accelerated(x + at.q(), qd, qdd_.data());
  if (at.nz() > 0) {
    internal::StateRates<T>(*ws_, x + at.q(), qd, z_rate_.data());
    start_x_.assign(x, x + at.size());
  }
  for (int i = 0; i < at.nv(); ++i) {
    u_[i] = (qd[i] + qdd_[i] * h) * h;
    v_[i] = qdd_[i] * h;
  }
  internal::Advance<T>(model, x, u_.data(), v_.data(), x);
  if (at.nz() > 0) MoveStates(h, z_rate_, start_x_.data(), x);
  companion->Moved(h, u_.data());
  return true;
}

// With stage tangents u_s = h a_s k_{s-1}, positions q_s = q Exp(u_s) and
// k_s = J_r(u_s)^-1 qd_s:  q+ = q Exp(h (k_1 + 2 k_2 + 2 k_3 + k_4) / 6), and
// the same sum of accelerations for qd, and of its rates for z.        (3.3)
template <typename T>
template <class Companion>
bool Stepper<T>::StepRungeKutta4(double h, const T* held, const T* x, T* out,
                                 Companion* companion, bool started) {
  const Model& model = ws_->model();
  using internal::kAhead, internal::kWeight;
  const StateLayout& at = model.layout();
  const int nv = at.nv(), nz = at.nz();
  if (nz > 0) start_x_.assign(x, x + at.size());  // `out` may be x
  std::copy_n(x, at.size(), stage_x_.begin());
  std::copy_n(x + at.qd(), nv, rate_.begin());  // J_r(0) = 1
  const T* stage_q = stage_x_.data() + at.q();
  const T* stage_qd = stage_x_.data() + at.qd();
  SeeStates(stage_x_.data());
  for (int stage = 0; stage < 4; ++stage) {
    if (!(started && stage == 0) &&
        !ForwardDynamics<T>(ws_, stage_q, stage_qd, held, qdd_.data())) {
      return false;
    }
    companion->Accelerated(stage_q, stage_qd, qdd_.data());
    for (int i = 0; i < nv; ++i) {
      if (stage == 0) {
        sum_u_[i] = rate_[i] * kWeight[0];
        sum_v_[i] = qdd_[i] * kWeight[0];
      } else {
        sum_u_[i] += rate_[i] * kWeight[stage];
        sum_v_[i] += qdd_[i] * kWeight[stage];
      }
    }
    if (nz > 0) {
      internal::StateRates<T>(*ws_, stage_q, stage_qd, z_rate_.data());
      for (int i = 0; i < nz; ++i) {
        const T z = z_rate_[i] * kWeight[stage];
        sum_z_[i] = stage == 0 ? z : sum_z_[i] + z;
      }
    }
    if (stage == 3) break;
    for (int i = 0; i < nv; ++i) {
      u_[i] = rate_[i] * (h * kAhead[stage]);
      v_[i] = qdd_[i] * (h * kAhead[stage]);
    }
    internal::Advance<T>(model, x, u_.data(), v_.data(), stage_x_.data());
    if (nz > 0) {
      MoveStates(h * kAhead[stage], z_rate_, start_x_.data(), stage_x_.data());
    }
    internal::TangentRate<T>(model, u_.data(), stage_qd, rate_.data());
    companion->MovedStage(stage, h, u_.data(), stage_qd);
  }
  for (int i = 0; i < nv; ++i) {
    u_[i] = sum_u_[i] * h;
    v_[i] = sum_v_[i] * h;
  }
  internal::Advance<T>(model, x, u_.data(), v_.data(), out);
  if (nz > 0) MoveStates(h, sum_z_, start_x_.data(), out);
  companion->MovedStage(3, h, u_.data(), stage_qd);
  return true;
}

template <typename T>
bool Stepper<T>::SetBrake(const T* x) {
  const Model& model = ws_->model();
  const StateLayout& at = model.layout();
  std::fill(brake_.begin(), brake_.end(), 0.0);
  const T* q = internal::AllPositions<T>(ws_, x + at.q());
  const T* qd = x + at.qd();
  if (!model.followers().empty()) {
    qd = internal::AllRates<T>(ws_, qd, &ws_->yd);
  }
  std::fill(by_qd_.begin(), by_qd_.end(), Eigen::Matrix3d::Zero());
  for (Damper& damper : dampers_) {
    const Body& body = model.bodies()[damper.body];
    const int nv = VelocitySize(body.type);
    Jet8 q_jet[4], qd_jet[3], tau[3];
    const int nq = body.type == JointType::kSpherical ? 4 : 1;
    for (int k = 0; k < nq; ++k) q_jet[k] = Jet8(ValueOf(q[body.q_index + k]));
    for (int k = 0; k < nv; ++k) {
      qd_jet[k] = Jet8(ValueOf(qd[body.v_index + k]), k);
      tau[k] = Jet8(0.0);
    }
    for (size_t k = 0; k < damper.p.size(); ++k) {
      damper.p[k] = Jet8(ValueOf(ws_->parameters().effects[damper.first + k]));
    }
    damper.hooks->AddEffort(JointState<Jet8>{body.type, nv, q_jet, qd_jet},
                            damper.p.data(), tau);
    for (int i = 0; i < nv; ++i) {
      for (int j = 0; j < nv; ++j) by_qd_[damper.body](i, j) += tau[i].v[j];
    }
  }
  bool any = false;
  for (const Damper& damper : dampers_) {
    const Body& body = model.bodies()[damper.body];
    const int nv = VelocitySize(body.type);
    const double D = internal::FastestDecay(by_qd_[damper.body], nv);
    for (int k = 0; k < nv; ++k) brake_[body.v_index + k] = D;
    any = any || D > 0.0;
  }
  return any;
}

template <typename T>
void Stepper<T>::Brake(double h) {
  const std::vector<Body>& bodies = ws_->model().bodies();
  for (size_t i = 0; i < bodies.size(); ++i) {
    BodyData<T>& b = ws_->bodies[i];
    free_armature_[i] = b.armature;
    had_armature_[i] = b.has_armature;
    const double D = brake_[bodies[i].v_index];
    if (!(D > 0.0)) continue;
    b.armature += T(kRosenbrockGamma * h * D);
    b.has_armature = true;
  }
}

template <typename T>
void Stepper<T>::Release() {
  for (size_t i = 0; i < ws_->bodies.size(); ++i) {
    ws_->bodies[i].armature = free_armature_[i];
    ws_->bodies[i].has_armature = had_armature_[i];
  }
  ws_->beside = nullptr;
}

// With D >= 0 of the joints' own effects at the start of the step, (3.8).
template <typename T>
template <class Companion>
bool Stepper<T>::StepRosenbrock2(double h, const T* held, T* x,
                                 Companion* companion) {
  const Model& model = ws_->model();
  const StateLayout& at = model.layout();
  const int nv = at.nv(), nz = at.nz();
  const double gh = kRosenbrockGamma * h;
  start_x_.assign(x, x + at.size());
  std::copy_n(x, at.size(), stage_x_.begin());
  const T* stage_q = stage_x_.data() + at.q();
  const T* stage_qd = stage_x_.data() + at.qd();
  SeeStates(stage_x_.data());
  const bool braked = SetBrake(x);
  if (braked) Brake(h);
  const auto stages = [&] {
    if (!ForwardDynamics<T>(ws_, stage_q, stage_qd, held, qdd_.data())) {
      return false;
    }
    companion->Accelerated(stage_q, stage_qd, qdd_.data());
    for (int i = 0; i < nv; ++i) {
      sum_u_[i] = stage_qd[i] + qdd_[i] * gh;
      sum_v_[i] = qdd_[i];
      u_[i] = sum_u_[i] * h;
      v_[i] = qdd_[i] * h;
    }
    if (nz > 0) {
      internal::StateRates<T>(*ws_, stage_q, stage_qd, sum_z_.data());
    }
    internal::Advance<T>(model, x, u_.data(), v_.data(), stage_x_.data());
    if (nz > 0) {
      MoveStates(h, sum_z_, start_x_.data(), stage_x_.data());
    }
    internal::TangentRate<T>(model, u_.data(), stage_qd, rate_.data());
    companion->MovedBraked(0, h, u_.data(), stage_qd);
    if (braked) {
      const T* k_1 = sum_v_.data();
      if (!model.followers().empty()) {
        k_1 = internal::AllRates<T>(ws_, k_1, &ws_->ydd);
      }
      for (size_t i = 0; i < beside_.size(); ++i) {
        beside_[i] = k_1[i] * (2.0 * gh * brake_[i]);
      }
      ws_->beside = beside_.data();
    }
    if (!ForwardDynamics<T>(ws_, stage_q, stage_qd, held, qdd_.data())) {
      return false;
    }
    companion->Accelerated(stage_q, stage_qd, qdd_.data());
    for (int i = 0; i < nv; ++i) {
      u_[i] =
          (sum_u_[i] + rate_[i] + (qdd_[i] - sum_v_[i] * 2.0) * gh) * (0.5 * h);
      v_[i] = (sum_v_[i] + qdd_[i]) * (0.5 * h);
    }
    internal::Advance<T>(model, x, u_.data(), v_.data(), x);
    if (nz > 0) {
      internal::StateRates<T>(*ws_, stage_q, stage_qd, z_rate_.data());
      for (int i = 0; i < nz; ++i) sum_z_[i] += z_rate_[i];
      MoveStates(0.5 * h, sum_z_, start_x_.data(), x);
    }
    companion->MovedBraked(1, h, u_.data(), stage_qd);
    return true;
  };
  const bool ok = stages();
  if (braked) Release();
  return ok;
}

}  // namespace sysid

#include "models/dry_step-impl.h"
