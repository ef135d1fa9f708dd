#pragma once

#include <algorithm>

#include "models/math/products.h"
#include "models/motion-impl.h"

// Pairs of joints (kPairHook): what turns with z = q_a + s q_b. Included by the
// .cc files that instantiate the dynamics. Equation numbers: docs/theory.md.

namespace sysid {
namespace internal {

// g of (2.34), and how it meets vectors of all joints.
template <typename T>
struct PairDirection {
  int a, b;
  T ratio;

  template <typename Bound>
  PairDirection(const Workspace<T>& ws, const Bound& effect)
      : a(ws.model().bodies()[effect.body].v_index),
        b(ws.model().bodies()[effect.second_body].v_index),
        ratio(effect.hooks->Ratio(effect.p)) {}
  T Of(const T* x) const { return x[a] + ratio * x[b]; }
  void Add(const T& along, T* x) const {
    x[a] += along;
    x[b] += ratio * along;
  }
};

// (2.34): what pairs of joints take from the drives, at rates and accelerations
// of all joints.
template <typename T>
void AddPairs(const Workspace<T>& ws, const T* qd, const T* qdd, T* tau) {
  for (const auto& effect : ws.pair_effects) {
    const PairDirection<T> g(ws, effect);
    g.Add(effect.hooks->PairInertia(effect.p) * g.Of(qdd) -
              effect.hooks->PairEffort(g.Of(qd), effect.p),
          tau);
  }
}

// Their efforts alone.
template <typename T>
void AddPairEfforts(const Workspace<T>& ws, const T* qd, T* tau) {
  for (const auto& effect : ws.pair_effects) {
    const PairDirection<T> g(ws, effect);
    g.Add(effect.hooks->PairEffort(g.Of(qd), effect.p), tau);
  }
}

// (2.34).
template <typename T>
void AddPairMass(const Workspace<T>& ws, MatrixX<T>* M) {
  for (const auto& effect : ws.pair_effects) {
    const PairDirection<T> g(ws, effect);
    const T inertia = effect.hooks->PairInertia(effect.p);
    (*M)(g.a, g.a) += inertia;
    (*M)(g.a, g.b) += g.ratio * inertia;
    (*M)(g.b, g.a) += g.ratio * inertia;
    (*M)(g.b, g.b) += g.ratio * g.ratio * inertia;
  }
}

// (2.36): what the efforts in ws->tau do to the accelerations of the tree,
// after AccelerateBodies; overwrites them and the bias forces. kAdd: to qdd,
// the bodies' accelerations and what friction holds; kSet: qdd alone.
template <Into into, typename T>
void RespondToEfforts(Workspace<T>* ws, T* qdd) {
  const std::vector<Body>& bodies = ws->model().bodies();
  for (BodyData<T>& b : ws->bodies) {
    b.n.setZero();
    b.f.setZero();
  }
  for (int i = static_cast<int>(bodies.size()) - 1; i >= 0; --i) {
    const Body& body = bodies[i];
    BodyData<T>& b = ws->bodies[i];
    T* tau = ws->tau.data() + body.v_index;  // D^-1 u, or u of a hinge or slide
    Vector3<T> n = b.n, f = b.f;
    if (body.type == JointType::kSpherical) {
      const Vector3<T> tau_W = b.R_WB * Vector3<T>(tau[0], tau[1], tau[2]);
      const Vector3<T> x = b.D3_inverse * (tau_W - b.n);
      for (int k = 0; k < 3; ++k) tau[k] = x[k];
      if (b.has_armature) {
        n += b.I * x;
      } else {
        n = tau_W;
      }
      f += b.H.transpose() * x;
    } else {
      tau[0] -= Dot(b.axis, body.type == JointType::kPrismatic ? b.f : b.n);
      const T x = tau[0] * b.D_inverse;
      n += b.U_n * x;
      f += b.U_f * x;
    }
    if (body.parent >= 0) {
      AddForceToParent<T>(b.r, n, f, &ws->bodies[body.parent]);
    }
  }
  // Outwards, n and f are now the changes of alpha and a.
  for (size_t i = 0; i < bodies.size(); ++i) {
    const Body& body = bodies[i];
    BodyData<T>& b = ws->bodies[i];
    const bool rooted = body.parent < 0;
    b.n.setZero();
    b.f.setZero();
    if (!rooted) {
      const BodyData<T>& parent = ws->bodies[body.parent];
      b.n = parent.n;
      b.f = parent.f + Cross<T>(parent.n, b.r);
    }
    const T* tau = ws->tau.data() + body.v_index;
    T* out = qdd + body.v_index;
    if (body.type == JointType::kSpherical) {
      Vector3<T> wd(tau[0], tau[1], tau[2]);
      if (!rooted) {
        wd -= b.DH * b.f;
        if (b.has_armature) {
          wd -= b.D3_inverse * (b.I * b.n);
        } else {
          wd -= b.n;
        }
      }
      b.n += wd;
      const Vector3<T> wd_B = b.R_WB.transpose() * wd;
      for (int k = 0; k < 3; ++k) Store<into>(wd_B[k], out + k);
    } else {
      const T driven = tau[0] - Dot(b.U_n, b.n) - Dot(b.U_f, b.f);
      const T rate = driven * b.D_inverse;
      Store<into>(rate, out);
      (body.type == JointType::kPrismatic ? b.f : b.n) += b.axis * rate;
      if (into == Into::kAdd && b.dry == DryMode::kRests) b.u += driven;
    }
    if (into == Into::kAdd) {
      b.alpha += b.n;
      b.a += b.f;
    }
  }
}

// (2.35): x <- x - K g^T x of one pair.
template <typename T>
void TakePair(const Workspace<T>& ws, size_t k, T* x) {
  const T along = PairDirection<T>(ws, ws.pair_effects[k]).Of(x);
  for (size_t i = 0; i < ws.pair_K[k].size(); ++i) {
    x[i] -= ws.pair_K[k][i] * along;
  }
}

// (2.35), with qdd of the tree under the pairs' efforts: sets pair_K. False
// where an inertia is not positive.
template <typename T>
bool AcceleratePairs(Workspace<T>* ws, T* qdd) {
  const int nv = ws->model().nv();
  std::copy_n(qdd, nv, ws->force.begin());
  for (size_t k = 0; k < ws->pair_effects.size(); ++k) {
    const auto& effect = ws->pair_effects[k];
    const PairDirection<T> g(*ws, effect);
    T* K = ws->pair_K[k].data();
    std::fill(ws->tau.begin(), ws->tau.end(), T(0.0));
    g.Add(T(1.0), ws->tau.data());
    RespondToEfforts<Into::kSet>(ws, K);
    for (size_t l = 0; l < k; ++l) TakePair<T>(*ws, l, K);
    const T inertia = effect.hooks->PairInertia(effect.p);
    const T whole = inertia * g.Of(K) + T(1.0);
    if (!(ValueOf(whole) > 0.0)) return false;
    const T scale = inertia / whole;
    for (int i = 0; i < nv; ++i) K[i] *= scale;
    TakePair<T>(*ws, k, ws->force.data());
  }
  std::fill(ws->tau.begin(), ws->tau.end(), T(0.0));
  for (const auto& effect : ws->pair_effects) {
    const PairDirection<T> g(*ws, effect);
    g.Add(-effect.hooks->PairInertia(effect.p) * g.Of(ws->force.data()),
          ws->tau.data());
  }
  RespondToEfforts<Into::kAdd>(ws, qdd);
  return true;
}

}  // namespace internal
}  // namespace sysid
