#pragma once

#include "models/mechanism.h"

namespace sysid {

// Where the numbers of a state are; no other type knows. The state and the
// tangent by which two states differ (state.h) are
//
//   x = (q, qd, z),      size() = nq() + nv() + nz() numbers,
//   dx = (dq, dqd, dz),  tangent_size() = nv() + nv() + nz() numbers.
//
// z are the internal states of effects (EffectSet::states()), plain numbers;
// most models have none.
//
// A joint has ConfigurationSize(type) numbers in q and VelocitySize(type) in
// each of qd, dq and dqd: a spherical joint's quaternion has four numbers, and
// its change three. The functions of those names say where a part begins in x
// or dx, the whole of it or that of one joint (a Joint or a Body).
class StateLayout {
 public:
  explicit StateLayout(const Mechanism& mechanism, int nz = 0)
      : nq_(mechanism.nq), nv_(mechanism.nv), nz_(nz) {}

  int nq() const { return nq_; }
  int nv() const { return nv_; }
  int nz() const { return nz_; }
  int size() const { return nq_ + nv_ + nz_; }
  int tangent_size() const { return nv_ + nv_ + nz_; }

  // In x.
  int q() const { return 0; }
  int qd() const { return nq_; }
  int z() const { return nq_ + nv_; }
  template <typename J>
  int q(const J& joint) const {
    return q() + joint.q_index;
  }
  template <typename J>
  int qd(const J& joint) const {
    return qd() + joint.v_index;
  }

  // In dx.
  int dq() const { return 0; }
  int dqd() const { return nv_; }
  int dz() const { return nv_ + nv_; }
  template <typename J>
  int dq(const J& joint) const {
    return dq() + joint.v_index;
  }
  template <typename J>
  int dqd(const J& joint) const {
    return dqd() + joint.v_index;
  }

 private:
  int nq_, nv_, nz_;
};

}  // namespace sysid
