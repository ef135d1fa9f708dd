#pragma once

#include <cmath>

#include "models/parameters.h"

// Definition of ParameterMap's templates; included only where they are
// instantiated.

namespace sysid {
namespace internal {

// Of the entries xx, yy, zz, xy, xz, yz of a rotational inertia.
inline constexpr int kRow[6] = {0, 1, 2, 1, 2, 2};
inline constexpr int kColumn[6] = {0, 1, 2, 0, 0, 1};

inline int ApplyOrder(ParameterKind kind) { return static_cast<int>(kind); }

template <typename T>
void ApplyOne(const Mechanism& mechanism, const Parameter& parameter,
              const T& value, MechanismParameters<T>* out) {
  switch (parameter.kind) {
    case ParameterKind::kLength: {
      const T scale = value / T(parameter.nominal);
      for (const int j : mechanism.links[parameter.index].child_joints) {
        out->joint_p[j] *= scale;
      }
      out->links[parameter.index].com *= scale;
      out->links[parameter.index].inertia *= scale * scale;
      break;
    }
    case ParameterKind::kMass:
      out->links[parameter.index].mass = value;
      break;
    case ParameterKind::kCom:
      out->links[parameter.index].com[parameter.component] = value;
      break;
    case ParameterKind::kInertia: {
      const int row = kRow[parameter.component];
      const int column = kColumn[parameter.component];
      out->links[parameter.index].inertia(row, column) = value;
      out->links[parameter.index].inertia(column, row) = value;
      break;
    }
    case ParameterKind::kInertiaScale:
      out->links[parameter.index].inertia *= value;
      break;
    case ParameterKind::kJointOrigin:
      out->joint_p[parameter.index][parameter.component] = value;
      break;
    case ParameterKind::kGravity:
      out->gravity = value;
      break;
    case ParameterKind::kEffect:
      out->effects[parameter.index] = value;
      break;
  }
}

}  // namespace internal

template <typename T>
Matrix3<T> ParameterMap::InertiaOf(const Cholesky& block,
                                   const T* theta) const {
  using std::exp;
  Matrix3<T> L = Matrix3<T>::Zero();
  for (int k = 0; k < 6; ++k) {
    if (block.place[k] < 0) continue;
    const T& entry = theta[block.place[k]];
    L(internal::kRow[k], internal::kColumn[k]) =
        (k < 3 ? T(exp(entry)) : entry) * T(block.scale);
  }
  const Matrix3<T> S = L * L.transpose();
  return Matrix3<T>::Identity() * S.trace() - S;
}

template <typename T>
void ParameterMap::Apply(const T* theta, MechanismParameters<T>* out) const {
  model_->nominal().CastTo(out);
  for (int kind = 0; kind <= internal::ApplyOrder(ParameterKind::kEffect);
       ++kind) {
    if (kind == internal::ApplyOrder(ParameterKind::kInertia)) {
      for (const Cholesky& block : cholesky_) {
        out->links[block.link].inertia = InertiaOf<T>(block, theta);
      }
    }
    for (int i = 0; i < size(); ++i) {
      if (internal::ApplyOrder(parameters_[i].kind) != kind ||
          transformed_[i]) {
        continue;
      }
      internal::ApplyOne<T>(model_->mechanism(), parameters_[i], theta[i], out);
    }
  }
}

template <typename T>
void ParameterMap::ValuesOf(const T* theta, T* values) const {
  for (int i = 0; i < size(); ++i) values[i] = theta[i];
  for (const Cholesky& block : cholesky_) {
    const Matrix3<T> I = InertiaOf<T>(block, theta);
    for (int k = 0; k < 6; ++k) {
      if (block.place[k] >= 0) {
        values[block.place[k]] = I(internal::kRow[k], internal::kColumn[k]);
      }
    }
  }
}

}  // namespace sysid
