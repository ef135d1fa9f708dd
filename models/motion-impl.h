#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "models/math/congruence.h"
#include "models/math/products.h"
#include "models/math/rotation.h"
#include "models/workspace.h"

// What the algorithms of dynamics-impl.h share: where the bodies are, how they
// move, and the forces that this alone takes or makes. Equation numbers:
// docs/theory.md.

namespace sysid {
namespace internal {

// R_WB = R_WJ R_JB of a hinge.
template <typename T>
void TurnHinge(const Body& body, const T& q, const Matrix3<T>& R_WJ,
               Matrix3<T>* R_WB) {
  using std::cos;
  using std::sin;
  const T c = cos(q), s = sin(q);
  if (body.along >= 0) {
    // About a coordinate axis: that column stays, the next two turn.
    const int k = body.along, i = (k + 1) % 3, j = (k + 2) % 3;
    const T minus_s = -s;
    for (int row = 0; row < 3; ++row) {
      (*R_WB)(row, k) = R_WJ(row, k);
      Difference2<Into::kSet>(c, R_WJ(row, i), minus_s, R_WJ(row, j),
                              &(*R_WB)(row, i));
      Difference2<Into::kSet>(c, R_WJ(row, j), s, R_WJ(row, i),
                              &(*R_WB)(row, j));
    }
    return;
  }
  // Rodrigues' formula.
  const Eigen::Matrix3d cross = Skew<double>(body.axis);
  Matrix3<T> R_JB;
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      const double aa = body.axis[i] * body.axis[j];
      R_JB(i, j) = T(aa) + c * ((i == j ? 1.0 : 0.0) - aa) + s * cross(i, j);
    }
  }
  Multiply(R_WJ, R_JB, R_WB);
}

// (2.1) to (2.3): rotations and offsets.
template <typename T>
void PlaceBodies(Workspace<T>* ws, const T* q) {
  const std::vector<Body>& bodies = ws->model().bodies();
  for (size_t i = 0; i < bodies.size(); ++i) {
    const Body& body = bodies[i];
    BodyData<T>& b = ws->bodies[i];
    const bool rooted = body.parent < 0;
    const Matrix3<T>* R_WJ = nullptr;
    Matrix3<T> turned;
    if (rooted) {
      b.r = b.p_PB;
      turned = body.R_PJ.cast<T>();
      R_WJ = &turned;
    } else {
      const BodyData<T>& parent = ws->bodies[body.parent];
      Apply<Into::kSet>(parent.R_WB, b.p_PB, &b.r);
      R_WJ = &parent.R_WB;
      if (body.turned) {
        MultiplyByConstant(parent.R_WB, body.R_PJ, &turned);
        R_WJ = &turned;
      }
    }
    if (body.type == JointType::kSpherical) {
      const T* x = q + body.q_index;
      const Matrix3<T> R_JB = ToMatrix(Quaternion<T>(x[3], x[0], x[1], x[2]));
      if (rooted && !body.turned) {
        b.R_WB = R_JB;
      } else {
        Multiply(*R_WJ, R_JB, &b.R_WB);
      }
      continue;
    }
    if (body.type == JointType::kPrismatic) {
      b.R_WB = *R_WJ;
    } else {
      TurnHinge(body, q[body.q_index], *R_WJ, &b.R_WB);
    }
    if (body.along >= 0) {
      b.axis = b.R_WB.col(body.along);
    } else {
      ApplyToConstant(b.R_WB, body.axis, &b.axis);
    }
    if (body.type == JointType::kPrismatic) {
      Scale<Into::kAdd>(b.axis, q[body.q_index], &b.r);
    }
  }
}

// (2.4) to (2.6): velocities and the accelerations that remain with qdd = 0.
template <typename T>
void MoveBodies(Workspace<T>* ws, const T* qd, bool with_linear_velocity) {
  const std::vector<Body>& bodies = ws->model().bodies();
  for (size_t i = 0; i < bodies.size(); ++i) {
    const Body& body = bodies[i];
    BodyData<T>& b = ws->bodies[i];
    const bool rooted = body.parent < 0;
    const T* rate = qd + body.v_index;
    if (body.type == JointType::kPrismatic) {
      const Vector3<T> slide = b.axis * rate[0];
      b.c_w.setZero();
      if (rooted) {
        b.w.setZero();
        b.c_v.setZero();
        b.v = slide;
      } else {
        const BodyData<T>& parent = ws->bodies[body.parent];
        b.w = parent.w;
        const Vector3<T> wr = Cross<T>(parent.w, b.r);
        b.c_v = Cross<T>(parent.w, Vector3<T>(wr + slide + slide));
        if (with_linear_velocity) b.v = parent.v + wr + slide;
      }
      continue;
    }
    Vector3<T> spin;
    if (body.type == JointType::kSpherical) {
      Apply<Into::kSet>(b.R_WB, Vector3<T>(rate[0], rate[1], rate[2]), &spin);
    } else {
      Scale<Into::kSet>(b.axis, rate[0], &spin);
    }
    if (rooted) {
      b.w = spin;
      b.c_w.setZero();
      b.c_v.setZero();
      b.v.setZero();
    } else {
      const BodyData<T>& parent = ws->bodies[body.parent];
      b.w = parent.w + spin;
      Cross<Into::kSet>(parent.w, spin, &b.c_w);
      const Vector3<T> wr = Cross(parent.w, b.r);
      Cross<Into::kSet>(parent.w, wr, &b.c_v);
      if (with_linear_velocity) b.v = parent.v + wr;
    }
  }
}

// Forces of effects on links, taken from the bias force of their bodies (2.8).
template <typename T>
void ApplyLinkForces(Workspace<T>* ws) {
  for (const auto& effect : ws->link_force_effects) {
    BodyData<T>& b = ws->bodies[effect.body];
    const Vector3<T> com_B = ws->p_BL[effect.link] +
                             Rotate<T>(ws->model().placement(effect.link).R_BL,
                                       ws->parameters().links[effect.link].com);
    const Vector3<T> arm = b.R_WB * com_B;
    LinkState<T> state;
    state.w = b.w;
    state.v_com = b.v + Cross<T>(b.w, arm);
    state.R_WL =
        b.R_WB * ws->model().placement(effect.link).R_BL.template cast<T>();
    Vector3<T> force = Vector3<T>::Zero();
    effect.hooks->AddLinkForce(state, effect.p, &force);
    b.f -= force;
    b.n -= Cross<T>(arm, force);
  }
}

// What an effect gives its joint; dry friction by the joint's mode.
template <typename T>
void AddEffort(const EffectHooks<T>& hooks, bool dry, bool beside, DryMode mode,
               const JointState<T>& joint, const T* p, T* tau) {
  if (!dry || mode == DryMode::kSmoothed) {
    hooks.AddEffort(joint, p, tau);
    return;
  }
  if (beside) hooks.AddBesideDry(joint, p, tau);
  if (mode == DryMode::kForward) {
    tau[0] -= hooks.DryFriction(joint, p, joint.qd[0]);
  } else if (mode == DryMode::kBackward) {
    tau[0] += hooks.DryFriction(joint, p, -joint.qd[0]);
  }
}

// The mode of a body's dry friction: a follower's is its leader's, seen by it.
template <typename T>
DryMode DryModeOf(const Workspace<T>& ws, int i) {
  const Body& body = ws.model().bodies()[i];
  if (body.leader < 0) return ws.bodies[i].dry;
  const DryMode mode = ws.bodies[body.leader].dry;
  if (body.multiplier >= 0.0) return mode;
  return mode == DryMode::kForward    ? DryMode::kBackward
         : mode == DryMode::kBackward ? DryMode::kForward
                                      : mode;
}

// A joint as its dry friction sees it: with the effort and the inputs of the
// last evaluation alone.
template <typename T>
JointState<T> RestingJoint(const Workspace<T>& ws,
                           const typename Workspace<T>::Bound& effect) {
  const Body& body = ws.model().bodies()[effect.body];
  JointState<T> joint{body.type, VelocitySize(body.type), nullptr, nullptr};
  if (effect.more) {
    const T* given = ws.drive.empty() ? ws.held : ws.drive.data();
    joint.effort = given + body.v_index;
    joint.inputs = ws.held + effect.first_held;
  }
  return joint;
}

// The joint of an effect as it sees it; q and qd of all joints, (2.25).
template <typename T>
JointState<T> JointOf(const Workspace<T>& ws,
                      const typename Workspace<T>::Bound& effect, const T* q,
                      const T* qd) {
  const Body& body = ws.model().bodies()[effect.body];
  JointState<T> joint = RestingJoint(ws, effect);
  joint.q = q + body.q_index;
  joint.qd = qd + body.v_index;
  if (effect.more) {
    joint.all_q = q;
    joint.all_qd = qd;
  }
  if (effect.first_z >= 0) {
    joint.z = (ws.z == nullptr ? ws.nothing.data() : ws.z) + effect.first_z;
  }
  return joint;
}

// What the drives give, (2.32): the efforts, what effects give in their place,
// limited. To ws->drive, which has room where there are such effects.
template <typename T>
void SetDrive(Workspace<T>* ws, const T* q, const T* qd) {
  std::copy_n(ws->held, ws->model().nv(), ws->drive.begin());
  std::fill(ws->drive.begin() + ws->model().nv(), ws->drive.end(), T(0.0));
  for (const auto& effect : ws->drive_effects) {
    const JointState<T> joint = JointOf(*ws, effect, q, qd);
    const int v = ws->model().bodies()[effect.body].v_index;
    effect.hooks->AddEffort(joint, effect.p, &ws->drive[v]);
  }
  for (const auto& effect : ws->limit_effects) {
    const JointState<T> joint = JointOf(*ws, effect, q, qd);
    const int v = ws->model().bodies()[effect.body].v_index;
    effect.hooks->LimitDrive(joint, effect.p, &ws->drive[v]);
  }
}

// What levels of dry friction read, before anything is evaluated.
template <typename T>
void Hold(Workspace<T>* ws, const T* q, const T* qd, const T* held) {
  ws->held = held;
  if (!ws->drive.empty()) SetDrive(ws, q, qd);
}

// Adds to tau, of all joints (2.25), what the effects give beside the efforts
// that are held, (2.32), and what the workspace says beside these.
template <typename T>
void AddEffectEfforts(Workspace<T>* ws, const T* q, const T* qd, const T* held,
                      T* tau) {
  Hold(ws, q, qd, held);
  if (!ws->drive.empty()) {
    for (int v = 0; v < ws->model().nv(); ++v) tau[v] += ws->drive[v] - held[v];
  }
  for (const auto& effect : ws->effort_effects) {
    const int v = ws->model().bodies()[effect.body].v_index;
    AddEffort(*effect.hooks, effect.dry, effect.beside,
              DryModeOf(*ws, effect.body), JointOf(*ws, effect, q, qd),
              effect.p, tau + v);
  }
  if (ws->beside == nullptr) return;
  for (size_t v = 0; v < ws->tau.size(); ++v) tau[v] += ws->beside[v];
}

// Gravity as inputs move it.
template <typename T>
void SetGravity(Workspace<T>* ws, const T* held) {
  if (ws->gravity_effects.empty()) return;
  ws->gravity = ws->still_gravity;
  for (const auto& effect : ws->gravity_effects) {
    effect.hooks->ModifyGravity(held + effect.first_held, effect.p,
                                &ws->gravity);
  }
}

// (2.12): adds the force [n; f] to the parent's, moved by r.
template <typename T>
void AddForceToParent(const Vector3<T>& r, const Vector3<T>& n,
                      const Vector3<T>& f, BodyData<T>* parent) {
  parent->f += f;
  parent->n += n;
  Cross<Into::kAdd>(r, f, &parent->n);
}

// (2.7), (2.8): inertia about the body's origin in world axes, and the force
// that it takes to keep the body's velocity.
template <typename T>
void InertiaAndBias(BodyData<T>* body) {
  BodyData<T>& b = *body;
  SymmetricCongruence(b.R_WB, b.I_B, &b.I);
  Vector3<T> h;
  Apply<Into::kSet>(b.R_WB, b.h_B, &h);
  b.H = Skew<T>(h);
  b.M.setZero();
  b.M(0, 0) = b.M(1, 1) = b.M(2, 2) = b.mass;
  Vector3<T> Iw;
  Apply<Into::kSet>(b.I, b.w, &Iw);
  Cross<Into::kSet>(b.w, Iw, &b.n);
  Cross<Into::kSet>(b.w, Cross(b.w, h), &b.f);
  if constexpr (std::is_same_v<T, double>) {
    b.I_W = b.I;
    b.h_W = h;
  }
}

}  // namespace internal
}  // namespace sysid
