#pragma once

#include "models/math/rotation.h"
#include "models/model.h"

namespace sysid {

// A state x = (q, qd, z) and its tangent dx = (dq, dqd, dz), as StateLayout
// places them. A spherical joint's dq is a rotation vector in the child's axes:
//
//   x [+] dx = (q Exp(dq), Exp(dq)^T (qd + dqd))                       (3.1)
//   x1 [-] x0 = (Log(q0* q1), Exp(dq) qd1 - qd0)                       (3.2)
//
// (other joints: plain sums and differences). So a change of the rotation alone
// leaves the angular velocity where it is in the parent's axes. That matters to
// a thin rod: its twist about itself is nearly free, and with the velocity held
// in its own axes instead a twist would swing the rod; least squares then crawl
// along a curved valley (measured: 200 iterations instead of 10).

// (3.1). `out` may be x.
template <typename T>
void BoxPlus(const Model& model, const T* x, const T* dx, T* out) {
  const StateLayout& at = model.layout();
  for (const Body& body : model.movers()) {
    const T* q = x + at.q(body);
    const T* qd = x + at.qd(body);
    const T* dq = dx + at.dq(body);
    const T* dqd = dx + at.dqd(body);
    T* q_out = out + at.q(body);
    T* qd_out = out + at.qd(body);
    if (body.type == JointType::kSpherical) {
      const Quaternion<T> turn = Exp<T>(Vector3<T>(dq[0], dq[1], dq[2]));
      const Quaternion<T> moved =
          Multiply(Quaternion<T>(q[3], q[0], q[1], q[2]), turn);
      const Vector3<T> rate =
          ToMatrix(turn).transpose() *
          Vector3<T>(qd[0] + dqd[0], qd[1] + dqd[1], qd[2] + dqd[2]);
      for (int k = 0; k < 4; ++k) q_out[k] = moved.coeffs()[k];
      for (int k = 0; k < 3; ++k) qd_out[k] = rate[k];
    } else {
      q_out[0] = q[0] + dq[0];
      qd_out[0] = qd[0] + dqd[0];
    }
  }
  for (int i = 0; i < at.nz(); ++i) {
    out[at.z() + i] = x[at.z() + i] + dx[at.dz() + i];
  }
}

// (3.2).
template <typename T>
void BoxMinus(const Model& model, const T* x1, const T* x0, T* dx) {
  const StateLayout& at = model.layout();
  for (const Body& body : model.movers()) {
    const T* q1 = x1 + at.q(body);
    const T* q0 = x0 + at.q(body);
    const T* qd1 = x1 + at.qd(body);
    const T* qd0 = x0 + at.qd(body);
    T* dq = dx + at.dq(body);
    T* dqd = dx + at.dqd(body);
    if (body.type == JointType::kSpherical) {
      const Quaternion<T> turn =
          Multiply(Quaternion<T>(q0[3], -q0[0], -q0[1], -q0[2]),
                   Quaternion<T>(q1[3], q1[0], q1[1], q1[2]));
      const Vector3<T> phi = Log(turn);
      const Vector3<T> rate =
          ToMatrix(turn) * Vector3<T>(qd1[0], qd1[1], qd1[2]);
      for (int k = 0; k < 3; ++k) dq[k] = phi[k];
      for (int k = 0; k < 3; ++k) dqd[k] = rate[k] - qd0[k];
    } else {
      dq[0] = q1[0] - q0[0];
      dqd[0] = qd1[0] - qd0[0];
    }
  }
  for (int i = 0; i < at.nz(); ++i) {
    dx[at.dz() + i] = x1[at.z() + i] - x0[at.z() + i];
  }
}

// The neutral configuration at rest, z = 0.
inline Eigen::VectorXd NeutralState(const Model& model) {
  const StateLayout& at = model.layout();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(at.size());
  x.segment(at.q(), at.nq()) = model.mechanism().NeutralConfiguration();
  return x;
}

}  // namespace sysid
