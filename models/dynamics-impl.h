#pragma once

#include <cmath>

#include "models/dynamics.h"
#include "models/followers-impl.h"
#include "models/math/congruence.h"
#include "models/math/products.h"
#include "models/motion-impl.h"
#include "models/pairs-impl.h"
#include "models/workspace-impl.h"

// Definitions of dynamics.h; included only by the .cc files that instantiate
// them, which get those of workspace.h along. Equation numbers: docs/theory.md.

namespace sysid {
namespace internal {

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
    b.D_inverse = b.dry == DryMode::kRests ? T(0.0) : T(1.0) / D;
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
      const T driven = b.u - Dot(b.U_n, b.alpha) - Dot(b.U_f, b.a);
      out[0] = driven * b.D_inverse;
      if (b.dry == DryMode::kRests) b.u = driven;
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
bool ForwardDynamics(Workspace<T>* ws, const T* q, const T* qd, const T* held,
                     T* qdd) {
  if (!ws->model().followers().empty()) {
    return internal::AccelerateByMassMatrix<T>(ws, q, qd, held, qdd);
  }
  internal::SetGravity<T>(ws, held);
  internal::PlaceBodies<T>(ws, q);
  internal::MoveBodies<T>(ws, qd, !ws->link_force_effects.empty());
  for (BodyData<T>& body : ws->bodies) internal::InertiaAndBias<T>(&body);
  internal::ApplyLinkForces<T>(ws);
  for (size_t i = 0; i < ws->tau.size(); ++i) ws->tau[i] = held[i];
  internal::AddEffectEfforts<T>(ws, q, qd, held, ws->tau.data());
  internal::AddPairEfforts<T>(*ws, qd, ws->tau.data());
  if (!internal::ArticulateBodies<T>(ws, ws->tau.data())) return false;
  internal::AccelerateBodies<T>(ws, qdd);
  if (!ws->pair_effects.empty() && !internal::AcceleratePairs<T>(ws, qdd)) {
    return false;
  }
  for (size_t i = 0; i < ws->tau.size(); ++i) {
    if (!std::isfinite(ValueOf(qdd[i]))) return false;
  }
  return true;
}

namespace internal {

// The effort of the drives of all joints, (2.15).
template <typename T>
void InverseDynamicsOfTree(Workspace<T>* ws, const T* q, const T* qd,
                           const T* qdd, const T* held, T* tau) {
  const std::vector<Body>& bodies = ws->model().bodies();
  SetGravity<T>(ws, held);
  PlaceBodies<T>(ws, q);
  MoveBodies<T>(ws, qd, true);
  for (BodyData<T>& body : ws->bodies) InertiaAndBias<T>(&body);
  ApplyLinkForces<T>(ws);
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
  AddEffectEfforts<T>(ws, q, qd, held, ws->tau.data());
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
  AddPairs<T>(*ws, qd, qdd, tau);
}

// Of all joints, (2.16).
template <typename T>
void MassMatrixOfTree(Workspace<T>* ws, const T* q, MatrixX<T>* mass_matrix) {
  const std::vector<Body>& bodies = ws->model().bodies();
  const int nv = static_cast<int>(ws->tau.size());
  mass_matrix->setZero(nv, nv);
  PlaceBodies<T>(ws, q);
  for (BodyData<T>& body : ws->bodies) {
    body.w.setZero();
    InertiaAndBias<T>(&body);
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
      AddToParent<T>(b.r, b.I, b.H, b.M, b.n, b.f, &ws->bodies[body.parent]);
    }
  }
  AddPairMass<T>(*ws, mass_matrix);
}

}  // namespace internal

template <typename T>
void InverseDynamics(Workspace<T>* ws, const T* q, const T* qd, const T* qdd,
                     const T* held, T* tau) {
  if (held == nullptr) held = ws->nothing.data();
  if (ws->model().followers().empty()) {
    internal::InverseDynamicsOfTree<T>(ws, q, qd, qdd, held, tau);
    return;
  }
  internal::InverseDynamicsOfTree<T>(ws, internal::AllPositions<T>(ws, q),
                                     internal::AllRates<T>(ws, qd, &ws->yd),
                                     internal::AllRates<T>(ws, qdd, &ws->ydd),
                                     held, ws->y_tau.data());
  internal::ProjectEffort<T>(*ws, ws->y_tau.data(), tau);
}

template <typename T>
void MassMatrix(Workspace<T>* ws, const T* q, MatrixX<T>* mass_matrix) {
  if (ws->model().followers().empty()) {
    internal::MassMatrixOfTree<T>(ws, q, mass_matrix);
    return;
  }
  internal::MassMatrixOfTree<T>(ws, internal::AllPositions<T>(ws, q), &ws->M_y);
  internal::ProjectMass<T>(ws, mass_matrix);
}

template <typename T>
void ForwardKinematics(Workspace<T>* ws, const T* q) {
  internal::PlaceBodies<T>(ws, internal::AllPositions<T>(ws, q));
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

// The algorithms for one scalar, in the namespace.
#define SYSID_INSTANTIATE_DYNAMICS(T)                                 \
  template class Workspace<T>;                                        \
  template bool ForwardDynamics<T>(Workspace<T>*, const T*, const T*, \
                                   const T*, T*);                     \
  template void InverseDynamics<T>(Workspace<T>*, const T*, const T*, \
                                   const T*, const T*, T*);           \
  template void MassMatrix<T>(Workspace<T>*, const T*, MatrixX<T>*);  \
  template void ForwardKinematics<T>(Workspace<T>*, const T*);        \
  template Vector3<T> LinkPosition<T>(const Workspace<T>&, int);
