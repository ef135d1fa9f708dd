#include "models/dynamics_tangent.h"

#include <algorithm>

#include "models/math/rotation.h"

// Of a DynamicsTangent what there is once, and the columns; the point is in
// dynamics_tangent_point.cc, laws that read more than their joint in
// dynamics_tangent_wide.cc. Equation numbers: docs/theory.md.

namespace sysid {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr size_t kMostStates = 3;  // of an effect: as wide as a law is here
constexpr unsigned kCoveredHooks =
    kEffortHook | kJointInertiaHook | kGravityHook | kLinkForceHook |
    kInputHook | kMeasurementHook | kInputDelayHook | kDryFrictionHook |
    kBesideDryHook | kDriveHook | kLimitHook | kInputLagHook | kOwnDelayHook |
    kRatesHook | kReadsEffort | kStateRateHook | kMoveStateHook | kMotorHook |
    kPairHook;

bool Moves(const Jet8& x) { return (x.v.array() != 0.0).any(); }

template <class Derived>
bool Moves(const Eigen::MatrixBase<Derived>& x) {
  for (int j = 0; j < x.cols(); ++j) {
    for (int i = 0; i < x.rows(); ++i) {
      if (Moves(x(i, j))) return true;
    }
  }
  return false;
}

}  // namespace

ParameterColumns::ParameterColumns(const Model& model)
    : bodies(model.bodies().size()),
      effects(model.effects().parameters().size()) {}

ParameterColumns::ParameterColumns(const Workspace<Jet8>& ws)
    : ParameterColumns(ws.model()) {
  for (size_t i = 0; i < bodies.size(); ++i) {
    const BodyData<Jet8>& from = ws.bodies[i];
    OfBody& to = bodies[i];
    to.inertial = Moves(from.mass) || Moves(from.h_B) || Moves(from.I_B);
    to.origin = Moves(from.p_PB);
    to.armature = Moves(from.armature);
    to.mass = LanesOf(from.mass);
    to.h_B = LanesOf(from.h_B);
    for (int j = 0; j < 3; ++j) {
      to.I_B[j] = LanesOf(Vector3<Jet8>(from.I_B.col(j)));
    }
    to.p_PB = LanesOf(from.p_PB);
    to.J_a = LanesOf(from.armature);
  }
  gravity_moves = Moves(ws.gravity);
  gravity = LanesOf(ws.gravity);
  for (size_t i = 0; i < effects.size(); ++i) {
    effects[i].moves = Moves(ws.parameters().effects[i]);
    effects[i].d = LanesOf(ws.parameters().effects[i]);
  }
  for (const auto& effect : ws.link_force_effects) {
    const Matrix3d& R_BL = ws.model().placement(effect.link).R_BL;
    force_com.push_back(LanesOf(ws.p_BL[effect.link]) +
                        R_BL * LanesOf(ws.parameters().links[effect.link].com));
  }
}

bool DynamicsTangent::Covers(const Model& model) {
  if (!model.followers().empty()) return false;
  for (int i = 0; i < model.effects().size(); ++i) {
    const Effect& effect = model.effects().effect(i);
    if (effect.hooks() & ~kCoveredHooks) return false;
    if (effect.states().size() > kMostStates) return false;
  }
  return true;
}

DynamicsTangent::DynamicsTangent(const Model& model)
    : model_(&model),
      points_(model.bodies().size()),
      lanes_(model.bodies().size()) {
  const EffectSet& effects = model.effects();
  for (int i = 0; i < effects.size(); ++i) {
    const Effect& effect = effects.effect(i);
    Law law;
    law.hooks = &HooksFor(effect, ScalarTag<Jet8>());
    law.first = effects.offset(i);
    law.p.resize(effect.parameters().size());
    law.by_p.resize(effect.parameters().size());
    law.link = effect.link();
    law.dry = (effect.hooks() & kDryFrictionHook) != 0;
    law.beside = (effect.hooks() & kBesideDryHook) != 0;
    if ((effect.hooks() & (kEffortHook | kLimitHook)) && effect.ReadsMore()) {
      const int child = model.mechanism().joints[effect.joint()].child_link;
      law.body = model.placement(child).body;
      AddWideLaw(i, law);
    } else if (effect.hooks() & kEffortHook) {
      const int child = model.mechanism().joints[effect.joint()].child_link;
      law.body = model.placement(child).body;
      points_[law.body].has_effort = true;
      efforts_.push_back(law);
    }
    if (effect.hooks() & kStateRateHook) {
      const int child = model.mechanism().joints[effect.joint()].child_link;
      law.body = model.placement(child).body;
      AddWideLaw(i, law, true);
    }
    if (effect.hooks() & kPairHook) {
      const int child = model.mechanism().joints[effect.joint()].child_link;
      law.body = model.placement(child).body;
      AddWideLaw(i, law);
      pairs_.push_back({wide_.back().v, wide_.back().v_second, 0.0, nullptr});
    }
    if (effect.hooks() & kLinkForceHook) {
      law.body = model.placement(effect.link()).body;
      if (law.body >= 0) link_forces_.push_back(law);
    }
    if ((effect.hooks() & kGravityHook) && !effect.inputs().empty()) {
      law.body = -1;
      AddWideLaw(i, law);
      moves_gravity_ = true;
    }
  }
  std::stable_sort(
      wide_.begin(), wide_.end(),
      [](const WideLaw& a, const WideLaw& b) { return a.of < b.of; });
  if (wide_.empty()) return;
  drive_.resize(model.nv());
  drive_lanes_.resize(model.nv());
  wide_lanes_.resize(model.nv());
}

void DynamicsTangent::Columns(const ParameterColumns& theta, const Moved& by,
                              Lanes* dqdd) {
  MoveColumns(theta, by);
  ForceColumns(theta);
  if (!link_forces_.empty()) LinkForceColumns(theta, by.dq, by.dqd);
  EffortColumns(theta, by);
  ArticulateColumns(theta, by.dq);
  AccelerateColumns(dqdd);
  for (const Pair& pair : pairs_) {  // (2.35)
    const Lanes along = dqdd[pair.a] + dqdd[pair.b] * pair.ratio;
    for (int i = 0; i < model_->nv(); ++i) dqdd[i] -= along * pair.K[i];
  }
}

// (2.18), (2.19), outwards.
void DynamicsTangent::MoveColumns(const ParameterColumns& theta,
                                  const Moved& by) {
  const Lanes *dq = by.dq, *dqd = by.dqd;
  Lanes3 root_a = theta.gravity_moves ? theta.gravity * -1.0 : ZeroLanes3();
  if (moves_gravity_) {
    for (const WideLaw& wide : wide_) {
      if (wide.of != WideLaw::Of::kGravity) continue;
      root_a.x -= WideColumn(wide, theta, by, 0);
      root_a.y -= WideColumn(wide, theta, by, 1);
      root_a.z -= WideColumn(wide, theta, by, 2);
    }
  }
  for (size_t i = 0; i < lanes_.size(); ++i) {
    const Body& body = model_->bodies()[i];
    const BodyData<double>& b = ws_->bodies[i];
    const BodyPoint& p = points_[i];
    BodyLanes& d = lanes_[i];
    const bool rooted = body.parent < 0;
    const Lanes &dq_i = dq[body.v_index], &dqd_i = dqd[body.v_index];
    if (body.type == JointType::kSpherical) {
      d.psi = b.R_WB * Load3(&dq_i);
      d.s = b.R_WB * Load3(&dqd_i);
    }
    if (rooted) {
      const Lanes3 a = root_a;
      d.alpha = ZeroLanes3();
      if (body.type == JointType::kSpherical) {
        d.w = d.s;
        d.a = a + Cross(b.a, d.psi);
      } else if (body.type == JointType::kPrismatic) {
        d.w = ZeroLanes3();
        d.a = a;
      } else {
        d.w = b.axis * dqd_i;
        d.a = a + p.a_q * dq_i;
      }
      continue;
    }
    const BodyData<double>& parent = ws_->bodies[body.parent];
    const BodyLanes& P = lanes_[body.parent];
    Lanes3 a = P.a + Cross(P.alpha, b.r) + p.V_r * P.w;
    if (theta.bodies[i].origin) {
      const Lanes3 r = parent.R_WB * theta.bodies[i].p_PB;
      a += Cross(parent.alpha, r) + Cross(parent.w, Cross(parent.w, r));
    }
    if (body.type == JointType::kSpherical) {
      const Lanes3 w_P = P.w + Cross(parent.w, d.psi);
      d.w = w_P + d.s;
      d.alpha = P.alpha + Cross(parent.alpha, d.psi) + Cross(w_P, p.spin) +
                Cross(parent.w, d.s);
      d.a = a + Cross(b.a, d.psi);
    } else if (body.type == JointType::kPrismatic) {
      d.w = P.w;
      d.alpha = P.alpha;
      d.a = a + Cross(P.w, p.spin) * 2.0 + p.a_q * dq_i + p.a_qd * dqd_i;
    } else {
      d.w = P.w + p.w_q * dq_i + b.axis * dqd_i;
      d.alpha = P.alpha + Cross(P.w, p.spin) + p.alpha_q * dq_i + p.w_q * dqd_i;
      d.a = a + p.a_q * dq_i;
    }
  }
}

// (2.21).
void DynamicsTangent::ForceColumns(const ParameterColumns& theta) {
  for (size_t i = 0; i < lanes_.size(); ++i) {
    const BodyData<double>& b = ws_->bodies[i];
    const BodyPoint& p = points_[i];
    BodyLanes& d = lanes_[i];
    d.n = Cross(b.h_W, d.a) + p.V_I * d.w;
    d.f = d.a * b.mass + p.V_h * d.w;
    if (model_->bodies()[i].parent >= 0) {  // else alpha is still
      d.n += b.I_W * d.alpha;
      d.f += Cross(d.alpha, b.h_W);
    }
    const ParameterColumns::OfBody& by = theta.bodies[i];
    if (!by.inertial) continue;
    const Lanes3 h = b.R_WB * by.h_B;
    d.f += b.a * by.mass + Cross(b.alpha, h) + Cross(b.w, Cross(b.w, h));
    const Vector3d w_B = b.R_WB.transpose() * b.w;
    const Vector3d alpha_B = b.R_WB.transpose() * b.alpha;
    const Lanes3 I_w =
        by.I_B[0] * w_B[0] + by.I_B[1] * w_B[1] + by.I_B[2] * w_B[2];
    const Lanes3 I_alpha = by.I_B[0] * alpha_B[0] + by.I_B[1] * alpha_B[1] +
                           by.I_B[2] * alpha_B[2];
    d.n += Cross(h, b.a) + b.R_WB * (I_alpha + Cross(w_B, I_w));
  }
}

// (2.24).
void DynamicsTangent::LinkForceColumns(const ParameterColumns& theta,
                                       const Lanes* dq, const Lanes* dqd) {
  for (size_t i = 0; i < lanes_.size(); ++i) {
    const Body& body = model_->bodies()[i];
    const BodyData<double>& b = ws_->bodies[i];
    BodyLanes& d = lanes_[i];
    const Lanes &dq_i = dq[body.v_index], &dqd_i = dqd[body.v_index];
    d.phi = d.v = ZeroLanes3();
    if (body.parent >= 0) {
      const BodyData<double>& parent = ws_->bodies[body.parent];
      const BodyLanes& P = lanes_[body.parent];
      d.phi = P.phi;
      d.v = P.v + Cross(P.w, b.r);
      if (theta.bodies[i].origin) {
        d.v += Cross(parent.w, Lanes3(parent.R_WB * theta.bodies[i].p_PB));
      }
    }
    if (body.type == JointType::kPrismatic) {
      d.v += points_[i].w_q * dq_i + b.axis * dqd_i;
    } else {
      const Lanes3 psi =
          body.type == JointType::kSpherical ? d.psi : b.axis * dq_i;
      d.phi += psi;
      d.v += Cross(b.v, psi);
    }
  }
  for (size_t k = 0; k < link_forces_.size(); ++k) {
    const Law& law = link_forces_[k];
    const BodyData<double>& b = ws_->bodies[law.body];
    BodyLanes& d = lanes_[law.body];
    Lanes3 v_com = d.v + Cross(d.w, law.arm);
    Lanes3 force = law.by_w * d.w + law.by_phi * d.phi;
    if (!theta.force_com.empty()) {
      const Lanes3 arm = b.R_WB * theta.force_com[k];
      v_com += Cross(b.w, arm);
      d.n -= Cross(arm, law.force);
    }
    force += law.by_v * v_com;
    for (size_t j = 0; j < law.by_p.size(); ++j) {
      const ParameterColumns::OfNumber& by = theta.effects[law.first + j];
      if (by.moves) force += law.by_p[j] * by.d;
    }
    d.f -= force;
    d.n -= Cross(law.arm, force);
  }
}

// What the drives and the effects give, of (2.22): d tau, less d J_a qdd.
void DynamicsTangent::EffortColumns(const ParameterColumns& theta,
                                    const Moved& moved) {
  const Lanes *dq = moved.dq, *dqd = moved.dqd, *dtau = moved.dheld;
  if (!wide_.empty()) {
    WideColumns(theta, moved);
    dtau = drive_lanes_.data();
  }
  for (size_t i = 0; i < lanes_.size(); ++i) {
    const Body& body = model_->bodies()[i];
    const BodyPoint& p = points_[i];
    const ParameterColumns::OfBody& by = theta.bodies[i];
    BodyLanes& d = lanes_[i];
    const int v = body.v_index;
    if (body.type == JointType::kSpherical) {
      d.tau = dtau == nullptr ? ZeroLanes3()
                              : ws_->bodies[i].R_WB * Load3(dtau + v);
      if (p.has_effort) d.tau += p.tau_q * d.psi + p.tau_qd * d.s;
      if (by.armature) d.tau -= p.qdd_W * by.J_a;
    } else {
      d.tau.x = dtau == nullptr ? ZeroLanes() : dtau[v];
      if (p.has_effort) {
        d.tau.x += p.tau_q(0, 0) * dq[v] + p.tau_qd(0, 0) * dqd[v];
      }
      if (!wide_.empty()) d.tau.x += wide_lanes_[v];
      if (by.armature) d.tau.x -= p.qdd_W[0] * by.J_a;
    }
  }
  for (const Law& law : efforts_) {
    for (size_t j = 0; j < law.by_p.size(); ++j) {
      const ParameterColumns::OfNumber& by = theta.effects[law.first + j];
      if (by.moves) lanes_[law.body].tau += law.by_p[j] * by.d;
    }
  }
  if (moved.dbeside == nullptr) return;
  for (size_t i = 0; i < lanes_.size(); ++i) {
    const Body& body = model_->bodies()[i];
    const Lanes* beside = moved.dbeside + body.v_index;
    if (body.type == JointType::kSpherical) {
      lanes_[i].tau += ws_->bodies[i].R_WB * Load3(beside);
    } else {
      lanes_[i].tau.x += *beside;
    }
  }
}

// (2.22), (2.23), inwards.
void DynamicsTangent::ArticulateColumns(const ParameterColumns& theta,
                                        const Lanes* dq) {
  for (int i = static_cast<int>(lanes_.size()) - 1; i >= 0; --i) {
    const Body& body = model_->bodies()[i];
    const BodyData<double>& b = ws_->bodies[i];
    const BodyPoint& p = points_[i];
    BodyLanes& d = lanes_[i];
    const bool rooted = body.parent < 0;
    Lanes3 n, f;  // handed on, as the parent sees them
    if (body.type == JointType::kSpherical) {
      d.x = b.D3_inverse * (d.tau - d.n);
      if (rooted) continue;
      // Without an armature D is I: d n + I x is d tau.
      n = (b.has_armature ? d.n + b.I * d.x : d.tau) + Cross(d.psi, p.n);
      f = d.f + TransposedTimes(b.H, d.x) + Cross(d.psi, p.f);
    } else {
      const bool slide = body.type == JointType::kPrismatic;
      d.x.x = (d.tau.x - Dot(b.axis, slide ? d.f : d.n)) * b.D_inverse;
      if (rooted) continue;
      n = d.n + b.U_n * d.x.x + p.n_q * dq[body.v_index];
      f = d.f + b.U_f * d.x.x + p.f_q * dq[body.v_index];
    }
    BodyLanes& P = lanes_[body.parent];
    P.f += f;
    P.n += n + Cross(b.r, f);
    if (theta.bodies[i].origin) {
      const Lanes3 r = ws_->bodies[body.parent].R_WB * theta.bodies[i].p_PB;
      P.n += Cross(r, p.f);
    }
  }
}

// (2.14) of the columns, outwards: alpha and a are now what qdd does.
void DynamicsTangent::AccelerateColumns(Lanes* dqdd) {
  for (size_t i = 0; i < lanes_.size(); ++i) {
    const Body& body = model_->bodies()[i];
    const BodyData<double>& b = ws_->bodies[i];
    const BodyPoint& p = points_[i];
    BodyLanes& d = lanes_[i];
    const bool rooted = body.parent < 0;
    d.alpha = d.a = ZeroLanes3();
    if (!rooted) {
      const BodyLanes& P = lanes_[body.parent];
      d.alpha = P.alpha;
      d.a = P.a + Cross(P.alpha, b.r);
    }
    if (body.type == JointType::kSpherical) {
      Lanes3 wd = d.x;
      if (!rooted) {
        wd -= b.DH * d.a + (b.has_armature ? p.DI * d.alpha : d.alpha);
      }
      d.alpha += wd;
      Store3(TransposedTimes(b.R_WB, wd), dqdd + body.v_index);
    } else {
      Lanes& qdd = dqdd[body.v_index];
      qdd = d.x.x;
      if (!rooted) qdd -= Dot(p.DU_n, d.alpha) + Dot(p.DU_f, d.a);
      if (body.type == JointType::kPrismatic) {
        d.a += b.axis * qdd;
      } else {
        d.alpha += b.axis * qdd;
      }
    }
  }
}

}  // namespace sysid
