#pragma once

#include "models/math/rotation.h"
#include "models/model.h"

namespace sysid {

// State x = (q, qd), nq + nv numbers; tangent dx = (dq, dqd), 2 nv numbers. A
// spherical joint's dq is a rotation vector in the child's axes:
//
//   x [+] dx = (q Exp(dq), qd + dqd)                                   (3.1)
//   x1 [-] x0 = (Log(q0* q1), qd1 - qd0)                               (3.2)

// (3.1). `out` may be x.
template <typename T>
void BoxPlus(const Model& model, const T* x, const T* dx, T* out) {
  for (const Body& body : model.bodies()) {
    const T* q = x + body.q_index;
    const T* dq = dx + body.v_index;
    T* q_out = out + body.q_index;
    if (body.type == JointType::kSpherical) {
      Quaternion<T> moved =
          Multiply(Quaternion<T>(q[3], q[0], q[1], q[2]),
                   Exp<T>(Vector3<T>(dq[0], dq[1], dq[2])));
      for (int k = 0; k < 4; ++k) q_out[k] = moved.coeffs()[k];
    } else {
      q_out[0] = q[0] + dq[0];
    }
  }
  for (int i = 0; i < model.nv(); ++i) {
    out[model.nq() + i] = x[model.nq() + i] + dx[model.nv() + i];
  }
}

// (3.2).
template <typename T>
void BoxMinus(const Model& model, const T* x1, const T* x0, T* dx) {
  for (const Body& body : model.bodies()) {
    const T* q1 = x1 + body.q_index;
    const T* q0 = x0 + body.q_index;
    T* dq = dx + body.v_index;
    if (body.type == JointType::kSpherical) {
      const Vector3<T> phi =
          Log(Multiply(Quaternion<T>(q0[3], -q0[0], -q0[1], -q0[2]),
                       Quaternion<T>(q1[3], q1[0], q1[1], q1[2])));
      for (int k = 0; k < 3; ++k) dq[k] = phi[k];
    } else {
      dq[0] = q1[0] - q0[0];
    }
  }
  for (int i = 0; i < model.nv(); ++i) {
    dx[model.nv() + i] = x1[model.nq() + i] - x0[model.nq() + i];
  }
}

}  // namespace sysid
