#pragma once

#include <cmath>
#include <type_traits>

#include "models/dynamics.h"
#include "models/math/products.h"
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

// R S R^T of a symmetric S.
template <typename T>
void SymmetricCongruence(const Matrix3<T>& R, const Matrix3<T>& S,
                         Matrix3<T>* out) {
  Matrix3<T> RS;
  Multiply(R, S, &RS);
  FillSymmetric(out, [&](int i, int j, T* entry) {
    Sum3<Into::kSet>(RS(i, 0), R(j, 0), RS(i, 1), R(j, 1), RS(i, 2), R(j, 2),
                     entry);
  });
}

// M - H^T W where that is symmetric.
template <typename T>
void SubtractSymmetricProduct(const Matrix3<T>& H, const Matrix3<T>& W,
                              Matrix3<T>* M) {
  FillSymmetric(M, [&](int i, int j, T* entry) {
    Sum3<Into::kSubtract>(H(0, i), W(0, j), H(1, i), W(1, j), H(2, i), W(2, j),
                          entry);
  });
}

// Each column of m crossed from the left by r.
template <typename T>
void CrossColumns(const Vector3<T>& r, const Matrix3<T>& m, Matrix3<T>* out) {
  for (int j = 0; j < 3; ++j) {
    Difference2<Into::kSet>(r[1], m(2, j), r[2], m(1, j), &(*out)(0, j));
    Difference2<Into::kSet>(r[2], m(0, j), r[0], m(2, j), &(*out)(1, j));
    Difference2<Into::kSet>(r[0], m(1, j), r[1], m(0, j), &(*out)(2, j));
  }
}

// Inverse of a symmetric matrix by its adjugate; false where it is not positive
// definite.
template <typename T>
bool InvertSymmetric(const Matrix3<T>& S, Matrix3<T>* inverse) {
  T c00, c01, c02, c11, c12, c22, determinant;
  Difference2<Into::kSet>(S(1, 1), S(2, 2), S(2, 1), S(2, 1), &c00);
  Difference2<Into::kSet>(S(2, 0), S(2, 1), S(1, 0), S(2, 2), &c01);
  Difference2<Into::kSet>(S(1, 0), S(2, 1), S(2, 0), S(1, 1), &c02);
  Difference2<Into::kSet>(S(0, 0), S(2, 2), S(2, 0), S(2, 0), &c11);
  Difference2<Into::kSet>(S(1, 0), S(2, 0), S(0, 0), S(2, 1), &c12);
  Difference2<Into::kSet>(S(0, 0), S(1, 1), S(1, 0), S(1, 0), &c22);
  Sum3<Into::kSet>(S(0, 0), c00, S(1, 0), c01, S(2, 0), c02, &determinant);
  if (!(ValueOf(S(0, 0)) > 0.0) || !(ValueOf(c22) > 0.0) ||
      !(ValueOf(determinant) > 0.0)) {
    return false;
  }
  const T scale = T(1.0) / determinant;
  const T* adjugate[3][3] = {
      {&c00, &c01, &c02}, {&c01, &c11, &c12}, {&c02, &c12, &c22}};
  FillSymmetric(inverse, [&](int i, int j, T* entry) {
    Product<Into::kSet>(*adjugate[i][j], scale, entry);
  });
  return true;
}

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

// (2.12): adds the force [n; f] to the parent's, moved by r.
template <typename T>
void AddForceToParent(const Vector3<T>& r, const Vector3<T>& n,
                      const Vector3<T>& f, BodyData<T>* parent) {
  parent->f += f;
  parent->n += n;
  Cross<Into::kAdd>(r, f, &parent->n);
}

// (2.12) of an inertia [0 0; 0 M].
template <typename T>
void AddMassToParent(const Vector3<T>& r, const Matrix3<T>& M,
                     BodyData<T>* parent) {
  parent->M += M;
  Matrix3<T> rM;
  CrossColumns(r, M, &rM);
  parent->H += rM;
  // - r x M r x: row i is r x (row i of r x M).
  FillSymmetric(&parent->I, [&](int i, int j, T* entry) {
    const int k = (j + 1) % 3, l = (j + 2) % 3;
    Difference2<Into::kAdd>(r[k], rM(i, l), r[l], rM(i, k), entry);
  });
}

// (2.12): adds an articulated inertia and force to the parent's, moved by r.
template <typename T>
void AddToParent(const Vector3<T>& r, const Matrix3<T>& I, const Matrix3<T>& H,
                 const Matrix3<T>& M, const Vector3<T>& n, const Vector3<T>& f,
                 BodyData<T>* parent) {
  // I + r x H^T - H r x - r x M r x = I + (r x H^T) + (r x H^T)^T - r x M r x.
  const Matrix3<T> Ht = H.transpose();
  Matrix3<T> rH;
  CrossColumns(r, Ht, &rH);
  parent->I += I + rH + rH.transpose();
  parent->H += H;
  AddMassToParent(r, M, parent);
  AddForceToParent(r, n, f, parent);
}

// The backward pass of the articulated-body algorithm: (2.9) to (2.12).
template <typename T>
bool ArticulateBodies(Workspace<T>* ws, const T* tau) {
  const std::vector<Body>& bodies = ws->model().bodies();
  for (int i = static_cast<int>(bodies.size()) - 1; i >= 0; --i) {
    const Body& body = bodies[i];
    BodyData<T>& b = ws->bodies[i];
    BodyData<T>* parent = body.parent < 0 ? nullptr : &ws->bodies[body.parent];
    if (body.type == JointType::kSpherical) {
      const T* t = tau + body.v_index;
      Vector3<T> tau_W;
      Apply<Into::kSet>(b.R_WB, Vector3<T>(t[0], t[1], t[2]), &tau_W);
      b.u3 = tau_W - b.n;
      if (!b.has_armature) {
        if (!InvertSymmetric<T>(b.I, &b.D3_inverse)) return false;
      } else {
        Matrix3<T> D = b.I;
        for (int k = 0; k < 3; ++k) D(k, k) += b.armature;
        if (!InvertSymmetric<T>(D, &b.D3_inverse)) return false;
      }
      if (parent == nullptr) continue;
      // (2.11): U = [I; H^T], so without armature only M is handed on.
      Multiply(b.D3_inverse, b.H, &b.DH);
      SubtractSymmetricProduct(b.H, b.DH, &b.M);
      Vector3<T>& f = b.f;
      Apply<Into::kAdd>(b.M, b.c_v, &f);
      ApplyTransposed<Into::kAdd>(b.DH, b.u3, &f);
      if (!b.has_armature) {
        AddMassToParent(b.r, b.M, parent);
        AddForceToParent(b.r, tau_W, f, parent);
      } else {
        const Matrix3<T> V = b.D3_inverse * b.I;
        const Matrix3<T> I = b.I - b.I * V;
        const Matrix3<T> H = b.H - V.transpose() * b.H;
        const Vector3<T> n = b.n + I * b.c_w + H * b.c_v + V.transpose() * b.u3;
        f += H.transpose() * b.c_w;
        AddToParent<T>(b.r, I, H, b.M, n, f, parent);
      }
      continue;
    }
    // (2.9), (2.10) for one degree of freedom.
    T D, own;
    if (body.type == JointType::kPrismatic) {
      Apply<Into::kSet>(b.H, b.axis, &b.U_n);
      Apply<Into::kSet>(b.M, b.axis, &b.U_f);
      D = Dot(b.axis, b.U_f) + b.armature;
      own = Dot(b.axis, b.f);
    } else {
      Apply<Into::kSet>(b.I, b.axis, &b.U_n);
      ApplyTransposed<Into::kSet>(b.H, b.axis, &b.U_f);
      D = Dot(b.axis, b.U_n) + b.armature;
      own = Dot(b.axis, b.n);
    }
    if (!(ValueOf(D) > 0.0)) return false;
    b.u = tau[body.v_index] - own;
    b.D_inverse = T(1.0) / D;
    if (parent == nullptr) continue;
    // (2.11), in place.
    Vector3<T> Dn, Df;
    Scale<Into::kSet>(b.U_n, b.D_inverse, &Dn);
    Scale<Into::kSet>(b.U_f, b.D_inverse, &Df);
    SymmetricOuter<Into::kSubtract>(Dn, b.U_n, &b.I);
    SymmetricOuter<Into::kSubtract>(Df, b.U_f, &b.M);
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 3; ++i) {
        Product<Into::kSubtract>(Dn[i], b.U_f[j], &b.H(i, j));
      }
    }
    Apply<Into::kAdd>(b.I, b.c_w, &b.n);
    Apply<Into::kAdd>(b.H, b.c_v, &b.n);
    Scale<Into::kAdd>(Dn, b.u, &b.n);
    ApplyTransposed<Into::kAdd>(b.H, b.c_w, &b.f);
    Apply<Into::kAdd>(b.M, b.c_v, &b.f);
    Scale<Into::kAdd>(Df, b.u, &b.f);
    AddToParent<T>(b.r, b.I, b.H, b.M, b.n, b.f, parent);
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
      b.a = parent.a + b.c_v;
      Cross<Into::kAdd>(parent.alpha, b.r, &b.a);
    }
    T* out = qdd + body.v_index;
    if (body.type == JointType::kSpherical) {
      Apply<Into::kSubtract>(b.I, b.alpha, &b.u3);
      Apply<Into::kSubtract>(b.H, b.a, &b.u3);
      Vector3<T> wd, wd_B;
      Apply<Into::kSet>(b.D3_inverse, b.u3, &wd);
      b.alpha += wd;
      ApplyTransposed<Into::kSet>(b.R_WB, wd, &wd_B);
      for (int k = 0; k < 3; ++k) out[k] = wd_B[k];
    } else {
      out[0] = (b.u - Dot(b.U_n, b.alpha) - Dot(b.U_f, b.a)) * b.D_inverse;
      if (body.type == JointType::kPrismatic) {
        Scale<Into::kAdd>(b.axis, out[0], &b.a);
      } else {
        Scale<Into::kAdd>(b.axis, out[0], &b.alpha);
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
    parameters.links.push_back(
        {T(link.mass), link.com.cast<T>(), link.inertia.cast<T>()});
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
    const Vector3<T> com_B =
        p_BL[joint.child_link] + internal::Rotate<T>(child.R_BL, link.com);
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
  delay_effects.clear();
  measurement_effects.clear();
  gravity = Vector3<T>(T(0.0), T(0.0), -parameters_.gravity);
  const EffectSet& effects = model_->effects();
  for (int i = 0; i < effects.size(); ++i) {
    const Effect& effect = effects.effect(i);
    Bound bound{&HooksFor(effect, ScalarTag<T>()),
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
    if (hooks & kInputDelayHook) delay_effects.push_back(bound);
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
      b.a = parent.a + Cross<T>(parent.alpha, b.r) + b.c_v;
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
      const Vector3<T>& force = body.type == JointType::kPrismatic ? b.f : b.n;
      out[0] = b.axis.dot(force) + b.armature * rate[0] - given[0];
    }
    if (body.parent >= 0) {
      BodyData<T>& parent = ws->bodies[body.parent];
      parent.f += b.f;
      parent.n += b.n + Cross<T>(b.r, b.f);
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
        n += Cross<T>(above.r, f);
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
