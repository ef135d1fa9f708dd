#include <algorithm>

#include "models/dynamics_tangent.h"
#include "models/math/rotation.h"
#include "models/motion-impl.h"

// The point of a DynamicsTangent: what of the derivatives does not depend on
// the columns. Equation numbers: docs/theory.md.

namespace sysid {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The derivative of w x I w by w: [w] I - [I w].
Matrix3d GyroscopicByVelocity(const Matrix3d& I, const Vector3d& w,
                              const Vector3d& Iw) {
  Matrix3d V;
  for (int j = 0; j < 3; ++j) V.col(j) = w.cross(I.col(j));
  V(0, 1) += Iw[2];
  V(0, 2) -= Iw[1];
  V(1, 0) -= Iw[2];
  V(1, 2) += Iw[0];
  V(2, 0) += Iw[1];
  V(2, 1) -= Iw[0];
  return V;
}

Jet8 Seeded(double value, int place) { return JetOf(value, UnitLanes(place)); }

// A quaternion q = (v, w) with d(q Exp(dq)) by dq at 0, dq at `place` and the
// next two: (w 1 + [v]) / 2 over -v^T / 2.
void SeedRotation(const double* q, int place, Jet8* out) {
  const Vector3d v = 0.5 * Eigen::Map<const Vector3d>(q);
  const Lanes3 dq = {UnitLanes(place), UnitLanes(place + 1),
                     UnitLanes(place + 2)};
  const Lanes3 dv = dq * (0.5 * q[3]) + Cross(v, dq);
  out[0] = JetOf(q[0], dv.x);
  out[1] = JetOf(q[1], dv.y);
  out[2] = JetOf(q[2], dv.z);
  out[3] = JetOf(q[3], -Dot(v, dq));
}

Vector3d ColumnOf(const Jet8* x, int size, int place) {
  Vector3d out = Vector3d::Zero();
  for (int k = 0; k < size; ++k) out[k] = x[k].v[place];
  return out;
}

}  // namespace

void DynamicsTangent::SetPoint(const Workspace<double>& ws, const double* q,
                               const double* qd, const double* qdd) {
  ws_ = &ws;
  const int count = static_cast<int>(points_.size());
  for (int i = 0; i < count; ++i) SetBody(i, qd, qdd);
  for (Law& law : efforts_) DifferentiateEffort(q, qd, &law);
  if (!wide_.empty()) {
    std::copy_n(ws.held, drive_.size(), drive_.begin());
    for (WideLaw& wide : wide_) DifferentiateWide(q, qd, qdd, &wide);
  }
  for (size_t k = 0; k < pairs_.size(); ++k) {
    const auto& effect = ws.pair_effects[k];
    pairs_[k].ratio = effect.hooks->Ratio(effect.p);
    pairs_[k].K = ws.pair_K[k].data();
  }
  for (Law& law : link_forces_) DifferentiateLinkForce(&law);
  // (2.15): what each joint transmits.
  for (int i = count - 1; i >= 0; --i) {
    const Body& body = model_->bodies()[i];
    const BodyData<double>& b = ws.bodies[i];
    BodyPoint& p = points_[i];
    if (body.parent < 0) continue;
    points_[body.parent].f += p.f;
    points_[body.parent].n += p.n + b.r.cross(p.f);
    if (body.type == JointType::kPrismatic) {
      p.n_q = b.axis.cross(p.f);
      p.f_q.setZero();
    } else if (body.type != JointType::kSpherical) {
      p.n_q = b.axis.cross(p.n);
      p.f_q = b.axis.cross(p.f);
    }
  }
}

void DynamicsTangent::SetBody(int i, const double* qd, const double* qdd) {
  const Body& body = model_->bodies()[i];
  const BodyData<double>& b = ws_->bodies[i];
  BodyPoint& p = points_[i];
  const bool rooted = body.parent < 0;
  const bool ball = body.type == JointType::kSpherical;
  const bool slide = body.type == JointType::kPrismatic;
  // The body's own force: (2.8), (2.15).
  const Vector3d Iw = b.I_W * b.w;
  p.V_I = GyroscopicByVelocity(b.I_W, b.w, Iw);
  p.V_h = CentripetalByVelocity(b.w, b.h_W);
  p.n = b.I_W * b.alpha + b.h_W.cross(b.a) + b.w.cross(Iw);
  p.f = b.mass * b.a + b.alpha.cross(b.h_W) + b.w.cross(b.w.cross(b.h_W));
  if (p.has_effort) {
    p.tau_q.setZero();
    p.tau_qd.setZero();
  }
  if (ball) {
    p.qdd_W = b.R_WB * Eigen::Map<const Vector3d>(qdd + body.v_index);
  } else {
    p.qdd_W[0] = qdd[body.v_index];
    p.DU_n = b.U_n * b.D_inverse;
    p.DU_f = b.U_f * b.D_inverse;
    p.w_q.setZero();
    p.alpha_q.setZero();
    p.a_q = slide ? Vector3d::Zero() : Vector3d(b.a.cross(b.axis));
    p.a_qd.setZero();
  }
  if (rooted) return;
  const BodyData<double>& parent = ws_->bodies[body.parent];
  p.V_r = CentripetalByVelocity(parent.w, b.r);
  if (ball) {
    p.spin = b.w - parent.w;
    if (b.has_armature) p.DI = b.D3_inverse * b.I;
    return;
  }
  p.spin = b.axis * qd[body.v_index];
  p.w_q = parent.w.cross(b.axis);
  if (slide) {
    p.a_q = parent.alpha.cross(b.axis) + parent.w.cross(p.w_q);
    p.a_qd = 2.0 * p.w_q;
  } else {
    p.alpha_q = parent.alpha.cross(b.axis) + p.w_q.cross(p.spin);
  }
}

void DynamicsTangent::DifferentiateEffort(const double* q, const double* qd,
                                          Law* law) {
  const Body& body = model_->bodies()[law->body];
  BodyPoint& point = points_[law->body];
  const Matrix3d& R = ws_->bodies[law->body].R_WB;
  const bool ball = body.type == JointType::kSpherical;
  const int nv = VelocitySize(body.type);
  const int count = static_cast<int>(law->p.size());
  Jet8 q_jet[4], qd_jet[3], tau[3];
  // The law's arguments: dq, dqd, its parameters; eight derivatives at a time.
  for (int begin = 0; begin < 2 * nv + count; begin += kLanes) {
    if (ball) {
      SeedRotation(q + body.q_index, -begin, q_jet);
    } else {
      q_jet[0] = Seeded(q[body.q_index], -begin);
    }
    for (int k = 0; k < nv; ++k) {
      qd_jet[k] = Seeded(qd[body.v_index + k], nv + k - begin);
      tau[k] = Jet8(0.0);
    }
    for (int k = 0; k < count; ++k) {
      law->p[k] =
          Seeded(ws_->parameters().effects[law->first + k], 2 * nv + k - begin);
    }
    const JointState<Jet8> joint{body.type, nv, q_jet, qd_jet};
    internal::AddEffort(*law->hooks, law->dry, law->beside,
                        ws_->bodies[law->body].dry, joint, law->p.data(), tau);
    const int end = std::min(begin + kLanes, 2 * nv + count);
    for (int s = begin; s < end; ++s) {
      Vector3d by = ColumnOf(tau, nv, s - begin);
      if (ball) by = R * by;
      if (s >= 2 * nv) {
        law->by_p[s - 2 * nv] = by;
      } else if (ball) {
        (s < 3 ? point.tau_q : point.tau_qd) += by * R.col(s % 3).transpose();
      } else {
        (s == 0 ? point.tau_q : point.tau_qd)(0, 0) += by[0];
      }
    }
  }
}

// The laws come in the order of (2.32): drive_ is what the drives give before.
void DynamicsTangent::DifferentiateWide(const double* q, const double* qd,
                                        const double* qdd, WideLaw* wide) {
  Law& law = wide->law;
  const int count = static_cast<int>(wide->arguments.size());
  const int total = count + static_cast<int>(law.p.size());
  const double* z =
      ws_->z != nullptr ? ws_->z : ws_->nothing.data();  // of the point
  Jet8 effort;
  for (int begin = 0; begin < total; begin += kLanes) {
    if (wide->v >= 0) effort = Jet8(drive_[wide->v]);
    for (int s = 0; s < count; ++s) {
      const Argument& x = wide->arguments[s];
      switch (x.of) {
        case Argument::Of::kQ:
          wide->q[x.place] = Seeded(q[x.place], s - begin);
          break;
        case Argument::Of::kQd:
          wide->qd[x.place] = Seeded(qd[x.place], s - begin);
          break;
        case Argument::Of::kHeld:
          wide->held[x.place] = Seeded(ws_->held[x.place], s - begin);
          break;
        case Argument::Of::kEffort:
          effort = Seeded(drive_[x.place], s - begin);
          break;
        case Argument::Of::kZ:
          wide->z[x.place] = Seeded(z[x.place], s - begin);
      }
    }
    for (int k = 0; k < total - count; ++k) {
      law.p[k] =
          Seeded(ws_->parameters().effects[law.first + k], count + k - begin);
    }
    const Jet8* inputs = wide->held.data() + wide->first_held;
    Vector3<Jet8> out = Vector3<Jet8>::Zero();
    if (wide->v < 0) {
      for (int k = 0; k < 3; ++k) out[k] = Jet8(ws_->gravity[k]);
      law.hooks->ModifyGravity(inputs, law.p.data(), &out);
    } else if (wide->of == WideLaw::Of::kPair) {
      // g (F - I zdd) of (2.34), qdd held.
      const int a = wide->v, b = wide->v_second;
      const Jet8 ratio = law.hooks->Ratio(law.p.data());
      out[0] = law.hooks->PairEffort(wide->qd[a] + ratio * wide->qd[b],
                                     law.p.data()) -
               law.hooks->PairInertia(law.p.data()) * (ratio * qdd[b] + qdd[a]);
      out[1] = ratio * out[0];
    } else {
      const Body& body = model_->bodies()[law.body];
      const JointState<Jet8> joint{body.type,
                                   1,
                                   wide->q.data() + body.q_index,
                                   wide->qd.data() + body.v_index,
                                   &effort,
                                   inputs,
                                   wide->q.data(),
                                   wide->qd.data(),
                                   wide->z.data() + wide->first_z};
      if (wide->of == WideLaw::Of::kRate) {
        law.hooks->StateRate(joint, law.p.data(), out.data());
      } else if (wide->of == WideLaw::Of::kLimit) {
        out[0] = effort;
        law.hooks->LimitDrive(joint, law.p.data(), out.data());
      } else {
        internal::AddEffort(*law.hooks, law.dry, law.beside,
                            ws_->bodies[law.body].dry, joint, law.p.data(),
                            out.data());
      }
    }
    const int end = std::min(begin + kLanes, total);
    for (int s = begin; s < end; ++s) {
      const Vector3d by = ColumnOf(out.data(), wide->rows, s - begin);
      if (s >= count) {
        law.by_p[s - count] = by;
      } else {
        for (int k = 0; k < 3; ++k) wide->arguments[s].by[k] = by[k];
      }
    }
    if (begin + kLanes < total) continue;
    if (wide->of == WideLaw::Of::kDrive) drive_[wide->v] += out[0].a;
    if (wide->of == WideLaw::Of::kLimit) drive_[wide->v] = out[0].a;
  }
}

void DynamicsTangent::DifferentiateLinkForce(Law* law) {
  const BodyData<double>& b = ws_->bodies[law->body];
  const Matrix3d& R_BL = model_->placement(law->link).R_BL;
  const Matrix3d R_WL = b.R_WB * R_BL;
  law->arm = b.R_WB * (ws_->p_BL[law->link] +
                       R_BL * ws_->parameters().links[law->link].com);
  const Vector3d v_com = b.v + b.w.cross(law->arm);
  const int count = static_cast<int>(law->p.size());
  Matrix3d by_R;
  LinkState<Jet8> link;
  // The law's arguments: v_com, w, a turn of the link, its parameters.
  for (int begin = 0; begin < 9 + count; begin += kLanes) {
    for (int k = 0; k < 3; ++k) {
      link.v_com[k] = Seeded(v_com[k], k - begin);
      link.w[k] = Seeded(b.w[k], 3 + k - begin);
    }
    const Lanes3 turn = {UnitLanes(6 - begin), UnitLanes(7 - begin),
                         UnitLanes(8 - begin)};
    for (int j = 0; j < 3; ++j) {
      const Vector3d axis = R_WL.col(j);
      const Lanes3 turned = Cross(turn, axis);
      link.R_WL(0, j) = JetOf(axis[0], turned.x);
      link.R_WL(1, j) = JetOf(axis[1], turned.y);
      link.R_WL(2, j) = JetOf(axis[2], turned.z);
    }
    for (int k = 0; k < count; ++k) {
      law->p[k] =
          Seeded(ws_->parameters().effects[law->first + k], 9 + k - begin);
    }
    Vector3<Jet8> force = Vector3<Jet8>::Zero();
    law->hooks->AddLinkForce(link, law->p.data(), &force);
    const int end = std::min(begin + kLanes, 9 + count);
    for (int s = begin; s < end; ++s) {
      const Vector3d by = ColumnOf(force.data(), 3, s - begin);
      if (s >= 9) {
        law->by_p[s - 9] = by;
      } else {
        (s < 3 ? law->by_v : s < 6 ? law->by_w : by_R).col(s % 3) = by;
      }
    }
    for (int k = 0; k < 3; ++k) law->force[k] = force[k].a;
  }
  // (2.24): v, w and the force are seen from the body, which turns by phi.
  law->by_phi = by_R - law->by_v * Skew<double>(v_com) -
                law->by_w * Skew<double>(b.w) + Skew<double>(law->force);
  points_[law->body].f -= law->force;
  points_[law->body].n -= law->arm.cross(law->force);
}

}  // namespace sysid
