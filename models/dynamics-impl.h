#pragma once

#include <cmath>

#include "models/dynamics.h"
#include "models/math/rotation.h"

// Definitions of dynamics.h and workspace.h; included only by the .cc files
// that instantiate them. Equation numbers: docs/theory.md.

namespace sysid {
namespace internal {

template <typename T>
Vector3<T> Rotate(const Eigen::Matrix3d& R, const Vector3<T>& v) {
  Vector3<T> out;
  for (int i = 0; i < 3; ++i) {
    out[i] = v[0] * R(i, 0) + v[1] * R(i, 1) + v[2] * R(i, 2);
  }
  return out;
}

template <typename T>
Matrix3<T> RotateMatrix(const Eigen::Matrix3d& R, const Matrix3<T>& m) {
  Matrix3<T> out;
  for (int j = 0; j < 3; ++j) {
    const Vector3<T> column = m.col(j);
    out.col(j) = Rotate<T>(R, column);
  }
  return out;
}

// R S R^T of a symmetric S with a constant R.
template <typename T>
Matrix3<T> Congruence(const Eigen::Matrix3d& R, const Matrix3<T>& S) {
  const Matrix3<T> left = RotateMatrix<T>(R, S);
  return RotateMatrix<T>(R, Matrix3<T>(left.transpose()));
}

// R S R^T of a symmetric S: 6 of the 9 numbers are computed.
template <typename T>
Matrix3<T> SymmetricCongruence(const Matrix3<T>& R, const Matrix3<T>& S) {
  const Matrix3<T> RS = R * S;
  Matrix3<T> out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j <= i; ++j) {
      out(i, j) = RS(i, 0) * R(j, 0) + RS(i, 1) * R(j, 1) + RS(i, 2) * R(j, 2);
      out(j, i) = out(i, j);
    }
  }
  return out;
}

template <typename T>
Vector3<T> Cross(const Vector3<T>& a, const Vector3<T>& b) {
  return Vector3<T>(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                    a[0] * b[1] - a[1] * b[0]);
}

// Each column of m crossed from the left by r.
template <typename T>
Matrix3<T> CrossColumns(const Vector3<T>& r, const Matrix3<T>& m) {
  Matrix3<T> out;
  for (int j = 0; j < 3; ++j) {
    out(0, j) = r[1] * m(2, j) - r[2] * m(1, j);
    out(1, j) = r[2] * m(0, j) - r[0] * m(2, j);
    out(2, j) = r[0] * m(1, j) - r[1] * m(0, j);
  }
  return out;
}

// Inverse of a symmetric matrix by its adjugate; false where it is not positive
// definite.
template <typename T>
bool InvertSymmetric(const Matrix3<T>& S, Matrix3<T>* inverse) {
  const T c00 = S(1, 1) * S(2, 2) - S(1, 2) * S(1, 2);
  const T c01 = S(0, 2) * S(1, 2) - S(0, 1) * S(2, 2);
  const T c02 = S(0, 1) * S(1, 2) - S(0, 2) * S(1, 1);
  const T c11 = S(0, 0) * S(2, 2) - S(0, 2) * S(0, 2);
  const T c12 = S(0, 1) * S(0, 2) - S(0, 0) * S(1, 2);
  const T c22 = S(0, 0) * S(1, 1) - S(0, 1) * S(0, 1);
  const T determinant = S(0, 0) * c00 + S(0, 1) * c01 + S(0, 2) * c02;
  if (!(ValueOf(S(0, 0)) > 0.0) || !(ValueOf(c22) > 0.0) ||
      !(ValueOf(determinant) > 0.0)) {
    return false;
  }
  const T scale = T(1.0) / determinant;
  *inverse << c00 * scale, c01 * scale, c02 * scale,  //
      c01 * scale, c11 * scale, c12 * scale,          //
      c02 * scale, c12 * scale, c22 * scale;
  return true;
}

// The rotation of a body's frame relative to its parent body's, and the offset
// of its origin in the parent's axes.
template <typename T>
Matrix3<T> JointRotation(const Body& body, const T* q) {
  using std::cos;
  using std::sin;
  Matrix3<T> R;
  if (IsRotation1(body.type)) {
    const T c = cos(q[body.q_index]);
    const T s = sin(q[body.q_index]);
    for (int i = 0; i < 9; ++i) {
      R.data()[i] = c * body.B.data()[i] + s * body.C.data()[i] +
                    T(body.A.data()[i]);
    }
  } else if (body.type == JointType::kSpherical) {
    const T* x = q + body.q_index;
    R = RotateMatrix<T>(body.A, ToMatrix(Quaternion<T>(x[3], x[0], x[1], x[2])));
  } else {
    R = body.A.cast<T>();
  }
  return R;
}

// (2.1) to (2.3): rotations and offsets.
template <typename T>
void PlaceBodies(Workspace<T>* ws, const T* q) {
  const std::vector<Body>& bodies = ws->model().bodies();
  for (size_t i = 0; i < bodies.size(); ++i) {
    const Body& body = bodies[i];
    BodyData<T>& b = ws->bodies[i];
    const Matrix3<T> R_PB = JointRotation<T>(body, q);
    if (body.parent < 0) {
      b.R_WB = R_PB;
      b.r = b.p_PB;
    } else {
      const BodyData<T>& parent = ws->bodies[body.parent];
      b.R_WB = parent.R_WB * R_PB;
      b.r = parent.R_WB * b.p_PB;
    }
    if (body.type != JointType::kSpherical) {
      b.axis = b.R_WB * body.axis.cast<T>();
      if (body.type == JointType::kPrismatic) b.r += b.axis * q[body.q_index];
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
    const Vector3<T> spin =
        body.type == JointType::kSpherical
            ? Vector3<T>(b.R_WB * Vector3<T>(rate[0], rate[1], rate[2]))
            : Vector3<T>(b.axis * rate[0]);
    if (rooted) {
      b.w = spin;
      b.c_w.setZero();
      b.c_v.setZero();
      b.v.setZero();
    } else {
      const BodyData<T>& parent = ws->bodies[body.parent];
      b.w = parent.w + spin;
      b.c_w = Cross<T>(parent.w, spin);
      const Vector3<T> wr = Cross<T>(parent.w, b.r);
      b.c_v = Cross<T>(parent.w, wr);
      if (with_linear_velocity) b.v = parent.v + wr;
    }
  }
}

// Forces of effects on links, taken from the bias force of their bodies (2.8).
template <typename T>
void ApplyLinkForces(Workspace<T>* ws) {
  for (const auto& effect : ws->link_force_effects) {
    BodyData<T>& b = ws->bodies[effect.body];
    const Vector3<T> com_B =
        ws->p_BL[effect.link] +
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

template <typename T>
void AddEffectEfforts(Workspace<T>* ws, const T* q, const T* qd, T* tau) {
  for (const auto& effect : ws->effort_effects) {
    const Body& body = ws->model().bodies()[effect.body];
    const JointState<T> joint{body.type, VelocitySize(body.type),
                              q + body.q_index, qd + body.v_index};
    effect.hooks->AddEffort(joint, effect.p, tau + body.v_index);
  }
}

// (2.7), (2.8): inertia about the body's origin in world axes, and the force
// that it takes to keep the body's velocity.
template <typename T>
void InertiaAndBias(BodyData<T>* body) {
  BodyData<T>& b = *body;
  b.I = SymmetricCongruence<T>(b.R_WB, b.I_B);
  const Vector3<T> h = b.R_WB * b.h_B;
  b.H = Skew<T>(h);
  b.M.setZero();
  b.M(0, 0) = b.M(1, 1) = b.M(2, 2) = b.mass;
  b.n = Cross<T>(b.w, Vector3<T>(b.I * b.w));
  b.f = Cross<T>(b.w, Cross<T>(b.w, h));
}

// (2.12): adds an articulated inertia and force to the parent's, moved by r.
template <typename T>
void AddToParent(const Vector3<T>& r, const Matrix3<T>& I, const Matrix3<T>& H,
                 const Matrix3<T>& M, const Vector3<T>& n, const Vector3<T>& f,
                 BodyData<T>* parent) {
  const Matrix3<T> rM = CrossColumns<T>(r, M);
  parent->M += M;
  parent->H += H + rM;
  // I + r x H^T - H r x - r x M r x, symmetric: with K = H + rM / 2 it is
  // I + (r x K^T) + (r x K^T)^T.
  const Matrix3<T> K = H + rM * T(0.5);
  const Matrix3<T> rK = CrossColumns<T>(r, Matrix3<T>(K.transpose()));
  parent->I += I + rK + rK.transpose();
  parent->f += f;
  parent->n += n + Cross<T>(r, f);
}

// The backward pass of the articulated-body algorithm: (2.9) to (2.12).
template <typename T>
bool ArticulateBodies(Workspace<T>* ws, const T* tau) {
  const std::vector<Body>& bodies = ws->model().bodies();
  for (int i = static_cast<int>(bodies.size()) - 1; i >= 0; --i) {
    const Body& body = bodies[i];
    BodyData<T>& b = ws->bodies[i];
    BodyData<T>* parent =
        body.parent < 0 ? nullptr : &ws->bodies[body.parent];
    if (body.type == JointType::kSpherical) {
      const T* t = tau + body.v_index;
      const Vector3<T> tau_W = b.R_WB * Vector3<T>(t[0], t[1], t[2]);
      b.u3 = tau_W - b.n;
      Matrix3<T> D = b.I;
      for (int k = 0; k < 3; ++k) D(k, k) += b.armature;
      if (!InvertSymmetric<T>(D, &b.D_inverse)) return false;
      if (parent == nullptr) continue;
      // (2.11): U = [I; H^T], so without armature only M is handed on.
      const Matrix3<T> W = b.D_inverse * b.H;
      const Matrix3<T> M = b.M - b.H.transpose() * W;
      Vector3<T> f = b.f + M * b.c_v + W.transpose() * b.u3;
      if (!b.has_armature) {
        const Matrix3<T> zero = Matrix3<T>::Zero();
        AddToParent<T>(b.r, zero, zero, M, tau_W, f, parent);
      } else {
        const Matrix3<T> V = b.D_inverse * b.I;
        const Matrix3<T> I = b.I - b.I * V;
        const Matrix3<T> H = b.H - V.transpose() * b.H;
        const Vector3<T> n =
            b.n + I * b.c_w + H * b.c_v + V.transpose() * b.u3;
        f += H.transpose() * b.c_w;
        AddToParent<T>(b.r, I, H, M, n, f, parent);
      }
      continue;
    }
    // (2.9), (2.10) for one degree of freedom.
    T own;
    if (body.type == JointType::kPrismatic) {
      b.U_n = b.H * b.axis;
      b.U_f = b.M * b.axis;
      b.D = b.axis.dot(b.U_f) + b.armature;
      own = b.axis.dot(b.f);
    } else {
      b.U_n = b.I * b.axis;
      b.U_f = b.H.transpose() * b.axis;
      b.D = b.axis.dot(b.U_n) + b.armature;
      own = b.axis.dot(b.n);
    }
    if (!(ValueOf(b.D) > 0.0)) return false;
    b.u = tau[body.v_index] - own;
    if (parent == nullptr) continue;
    const T inverse = T(1.0) / b.D;
    const Vector3<T> Dn = b.U_n * inverse;
    const Vector3<T> Df = b.U_f * inverse;
    const Matrix3<T> I = b.I - Dn * b.U_n.transpose();
    const Matrix3<T> H = b.H - Dn * b.U_f.transpose();
    const Matrix3<T> M = b.M - Df * b.U_f.transpose();
    const Vector3<T> n = b.n + I * b.c_w + H * b.c_v + Dn * b.u;
    const Vector3<T> f = b.f + H.transpose() * b.c_w + M * b.c_v + Df * b.u;
    AddToParent<T>(b.r, I, H, M, n, f, parent);
  }
  return true;
}

// The last forward pass of the articulated-body algorithm: (2.13), (2.14).
template <typename T>
void AccelerateBodies(Workspace<T>* ws, T* qdd) {
  const std::vector<Body>& bodies = ws->model().bodies();
  for (size_t i = 0; i < bodies.size(); ++i) {
    const Body& body = bodies[i];
    BodyData<T>& b = ws->bodies[i];
    if (body.parent < 0) {
      b.alpha = b.c_w;
      b.a = b.c_v - ws->gravity;
    } else {
      const BodyData<T>& parent = ws->bodies[body.parent];
      b.alpha = parent.alpha + b.c_w;
      b.a = parent.a + Cross<T>(parent.alpha, b.r) + b.c_v;
    }
    T* out = qdd + body.v_index;
    if (body.type == JointType::kSpherical) {
      const Vector3<T> wd =
          b.D_inverse * Vector3<T>(b.u3 - b.I * b.alpha - b.H * b.a);
      b.alpha += wd;
      const Vector3<T> wd_B = b.R_WB.transpose() * wd;
      for (int k = 0; k < 3; ++k) out[k] = wd_B[k];
    } else {
      out[0] = (b.u - b.U_n.dot(b.alpha) - b.U_f.dot(b.a)) / b.D;
      if (body.type == JointType::kPrismatic) {
        b.a += b.axis * out[0];
      } else {
        b.alpha += b.axis * out[0];
      }
    }
  }
}

}  // namespace internal

template <typename T>
Workspace<T>::Workspace(const Model& model)
    : bodies(model.bodies().size()),
      p_BL(model.mechanism().links.size(), Vector3<T>::Zero()),
      tau(model.nv(), T(0.0)),
      model_(&model) {
  const MechanismParameters<double>& nominal = model.nominal();
  MechanismParameters<T> parameters;
  for (const Inertial<double>& link : nominal.links) {
    parameters.links.push_back({T(link.mass), link.com.cast<T>(),
                                link.inertia.cast<T>()});
  }
  for (const Eigen::Vector3d& p : nominal.joint_p) {
    parameters.joint_p.push_back(p.cast<T>());
  }
  parameters.gravity = T(nominal.gravity);
  for (const double value : nominal.effects) {
    parameters.effects.push_back(T(value));
  }
  SetParameters(parameters);
}

template <typename T>
void Workspace<T>::SetParameters(const MechanismParameters<T>& parameters) {
  parameters_ = parameters;
  const Mechanism& mechanism = model_->mechanism();
  for (BodyData<T>& body : bodies) {
    body.mass = T(0.0);
    body.h_B.setZero();
    body.I_B.setZero();
    body.armature = T(0.0);
    body.has_armature = false;
  }
  for (size_t i = 0; i < mechanism.joints.size(); ++i) {
    const Joint& joint = mechanism.joints[i];
    const int parent_link = joint.parent_link;
    const Placement& parent = model_->placement(parent_link);
    const Placement& child = model_->placement(joint.child_link);
    const Vector3<T> p_BJ =
        p_BL[parent_link] +
        internal::Rotate<T>(parent.R_BL, parameters_.joint_p[i]);
    if (joint.type == JointType::kFixed) {
      p_BL[joint.child_link] = p_BJ;
    } else {
      p_BL[joint.child_link].setZero();
      bodies[child.body].p_PB = p_BJ;
    }
    if (child.body < 0) continue;
    BodyData<T>& body = bodies[child.body];
    const Inertial<T>& link = parameters_.links[joint.child_link];
    const Vector3<T> com_B = p_BL[joint.child_link] +
                             internal::Rotate<T>(child.R_BL, link.com);
    const Vector3<T> h = com_B * link.mass;
    body.mass += link.mass;
    body.h_B += h;
    // Parallel axes: - m c x c x = m (|c|^2 - c c^T).
    body.I_B += internal::Congruence<T>(child.R_BL, link.inertia) -
                h * com_B.transpose() + Matrix3<T>::Identity() * h.dot(com_B);
  }
  BindEffects();
}

template <typename T>
void Workspace<T>::BindEffects() {
  effort_effects.clear();
  link_force_effects.clear();
  input_effects.clear();
  measurement_effects.clear();
  gravity = Vector3<T>(T(0.0), T(0.0), -parameters_.gravity);
  const EffectSet& effects = model_->effects();
  for (int i = 0; i < effects.size(); ++i) {
    const Effect& effect = effects.effect(i);
    Bound bound{&effect.HooksFor(ScalarTag<T>()),
                parameters_.effects.data() + effects.offset(i), -1,
                effect.link()};
    if (effect.joint() >= 0) {
      const int child = model_->mechanism().joints[effect.joint()].child_link;
      bound.body = model_->placement(child).body;
    } else if (effect.link() >= 0) {
      bound.body = model_->placement(effect.link()).body;
    }
    const unsigned hooks = effect.hooks();
    if (hooks & kEffortHook) effort_effects.push_back(bound);
    // A link that is fixed to the world does not feel a force.
    if ((hooks & kLinkForceHook) && bound.body >= 0) {
      link_force_effects.push_back(bound);
    }
    if (hooks & kInputHook) input_effects.push_back(bound);
    if (hooks & kMeasurementHook) measurement_effects.push_back(bound);
    if (hooks & kGravityHook) bound.hooks->ModifyGravity(bound.p, &gravity);
    if (hooks & kJointInertiaHook) {
      BodyData<T>& body = bodies[bound.body];
      bound.hooks->AddJointInertia(bound.p, &body.armature);
      body.has_armature = true;
    }
  }
}

template <typename T>
bool ForwardDynamics(Workspace<T>* ws, const T* q, const T* qd, const T* tau,
                     T* qdd) {
  internal::PlaceBodies<T>(ws, q);
  internal::MoveBodies<T>(ws, qd, !ws->link_force_effects.empty());
  for (BodyData<T>& body : ws->bodies) internal::InertiaAndBias<T>(&body);
  internal::ApplyLinkForces<T>(ws);
  for (size_t i = 0; i < ws->tau.size(); ++i) ws->tau[i] = tau[i];
  internal::AddEffectEfforts<T>(ws, q, qd, ws->tau.data());
  if (!internal::ArticulateBodies<T>(ws, ws->tau.data())) return false;
  internal::AccelerateBodies<T>(ws, qdd);
  for (size_t i = 0; i < ws->tau.size(); ++i) {
    if (!std::isfinite(ValueOf(qdd[i]))) return false;
  }
  return true;
}

template <typename T>
void InverseDynamics(Workspace<T>* ws, const T* q, const T* qd, const T* qdd,
                     T* tau) {
  const std::vector<Body>& bodies = ws->model().bodies();
  internal::PlaceBodies<T>(ws, q);
  internal::MoveBodies<T>(ws, qd, true);
  for (BodyData<T>& body : ws->bodies) internal::InertiaAndBias<T>(&body);
  internal::ApplyLinkForces<T>(ws);
  // (2.15): accelerations outwards, [n; f] += [I H; H^T M] [alpha; a].
  for (size_t i = 0; i < bodies.size(); ++i) {
    const Body& body = bodies[i];
    BodyData<T>& b = ws->bodies[i];
    if (body.parent < 0) {
      b.alpha = b.c_w;
      b.a = b.c_v - ws->gravity;
    } else {
      const BodyData<T>& parent = ws->bodies[body.parent];
      b.alpha = parent.alpha + b.c_w;
      b.a = parent.a + internal::Cross<T>(parent.alpha, b.r) + b.c_v;
    }
    const T* rate = qdd + body.v_index;
    if (body.type == JointType::kSpherical) {
      b.alpha += b.R_WB * Vector3<T>(rate[0], rate[1], rate[2]);
    } else if (body.type == JointType::kPrismatic) {
      b.a += b.axis * rate[0];
    } else {
      b.alpha += b.axis * rate[0];
    }
    b.n += b.I * b.alpha + b.H * b.a;
    b.f += b.H.transpose() * b.alpha + b.M * b.a;
  }
  // Forces inwards; what the effects give, the drives need not.
  for (T& effort : ws->tau) effort = T(0.0);
  internal::AddEffectEfforts<T>(ws, q, qd, ws->tau.data());
  for (int i = static_cast<int>(bodies.size()) - 1; i >= 0; --i) {
    const Body& body = bodies[i];
    BodyData<T>& b = ws->bodies[i];
    T* out = tau + body.v_index;
    const T* given = ws->tau.data() + body.v_index;
    const T* rate = qdd + body.v_index;
    if (body.type == JointType::kSpherical) {
      const Vector3<T> n_B = b.R_WB.transpose() * b.n;
      for (int k = 0; k < 3; ++k) {
        out[k] = n_B[k] + b.armature * rate[k] - given[k];
      }
    } else {
      const Vector3<T>& force =
          body.type == JointType::kPrismatic ? b.f : b.n;
      out[0] = b.axis.dot(force) + b.armature * rate[0] - given[0];
    }
    if (body.parent >= 0) {
      BodyData<T>& parent = ws->bodies[body.parent];
      parent.f += b.f;
      parent.n += b.n + internal::Cross<T>(b.r, b.f);
    }
  }
}

template <typename T>
void MassMatrix(Workspace<T>* ws, const T* q, MatrixX<T>* mass_matrix) {
  const std::vector<Body>& bodies = ws->model().bodies();
  const int nv = ws->model().nv();
  mass_matrix->setZero(nv, nv);
  internal::PlaceBodies<T>(ws, q);
  for (BodyData<T>& body : ws->bodies) {
    body.w.setZero();
    internal::InertiaAndBias<T>(&body);
  }
  // (2.16): composite inertias inwards, each joint's column on the way.
  for (int i = static_cast<int>(bodies.size()) - 1; i >= 0; --i) {
    const Body& body = bodies[i];
    const BodyData<T>& b = ws->bodies[i];
    const int size = VelocitySize(body.type);
    for (int k = 0; k < size; ++k) {
      const int column = body.v_index + k;
      Vector3<T> n, f;
      if (body.type == JointType::kPrismatic) {
        n = b.H * b.axis;
        f = b.M * b.axis;
      } else {
        const Vector3<T> s = body.type == JointType::kSpherical
                                 ? Vector3<T>(b.R_WB.col(k))
                                 : b.axis;
        n = b.I * s;
        f = b.H.transpose() * s;
      }
      for (int j = i; j >= 0; j = bodies[j].parent) {
        const BodyData<T>& above = ws->bodies[j];
        const int rows = VelocitySize(bodies[j].type);
        for (int m = 0; m < rows; ++m) {
          const int row = bodies[j].v_index + m;
          T value;
          if (bodies[j].type == JointType::kPrismatic) {
            value = above.axis.dot(f);
          } else if (bodies[j].type == JointType::kSpherical) {
            value = above.R_WB.col(m).dot(n);
          } else {
            value = above.axis.dot(n);
          }
          (*mass_matrix)(row, column) = value;
          (*mass_matrix)(column, row) = value;
        }
        n += internal::Cross<T>(above.r, f);
      }
      (*mass_matrix)(column, column) += b.armature;
    }
    if (body.parent >= 0) {
      internal::AddToParent<T>(b.r, b.I, b.H, b.M, b.n, b.f,
                               &ws->bodies[body.parent]);
    }
  }
}

template <typename T>
void ForwardKinematics(Workspace<T>* ws, const T* q) {
  internal::PlaceBodies<T>(ws, q);
  const std::vector<Body>& bodies = ws->model().bodies();
  for (size_t i = 0; i < bodies.size(); ++i) {
    BodyData<T>& b = ws->bodies[i];
    b.p_WB = b.r;
    if (bodies[i].parent >= 0) b.p_WB += ws->bodies[bodies[i].parent].p_WB;
  }
}

template <typename T>
Vector3<T> LinkPosition(const Workspace<T>& ws, int link) {
  const int body = ws.model().placement(link).body;
  if (body < 0) return ws.p_BL[link];
  const BodyData<T>& b = ws.bodies[body];
  return b.p_WB + b.R_WB * ws.p_BL[link];
}

}  // namespace sysid
