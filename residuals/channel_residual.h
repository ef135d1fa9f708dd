#pragma once

#include <array>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "models/dynamics.h"
#include "models/math/products.h"
#include "models/math/rotation.h"
#include "residuals/run.h"

namespace sysid {

// What one measured channel says of a state: functors (measurement in, error
// out, SI units, no weights). Each is a small const value. kSize numbers come
// out, of which kDof are independent (a unit vector in the plane has two
// components and one degree of freedom).

// Where a sensor of a joint's position is.
enum class SensedAt { kJoint, kMotor };

// The predicted state as the sensors see it.
template <typename T>
struct PredictedState {
  const T* q;  // with the effects' measurement hooks
  const T* qd;
  const T* motor_q;               // of the motors, alike; null if not asked
  const Workspace<T>* workspace;  // kinematics of the true q

  const T& Position(int q_index, SensedAt at) const {
    return (at == SensedAt::kMotor ? motor_q : q)[q_index];
  }
};

// (cos q, sin q) - (cos q^, sin q^): norm 2 |sin(error / 2)|, no branch cut.
// The measurement is the angle, rad.
struct PlanarHeadingResidual {
  static constexpr int kSize = 2;
  static constexpr int kDof = 1;
  int q_index;
  SensedAt at = SensedAt::kJoint;

  template <typename T>
  void operator()(const PredictedState<T>& state, const double* measured,
                  T* r) const {
    using std::cos;
    using std::sin;
    const T& q = state.Position(q_index, at);
    r[0] = cos(q) - cos(measured[0]);
    r[1] = sin(q) - sin(measured[0]);
  }
};

// R(q) a - R(q^) a, a the link's axis (LinkAxis) in its own frame. The
// measurement is the quaternion x, y, z, w; both signs give the same.
struct HeadingResidual {
  static constexpr int kSize = 3;
  static constexpr int kDof = 2;
  int q_index;
  Eigen::Vector3d axis;

  template <typename T>
  void operator()(const PredictedState<T>& state, const double* measured,
                  T* r) const {
    Vector3<T> z;
    TurnConstant(state.q + q_index, axis, &z);
    const Eigen::Vector3d z_measured =
        ToMatrix(Eigen::Quaterniond(measured[3], measured[0], measured[1],
                                    measured[2])) *
        axis;
    for (int k = 0; k < 3; ++k) r[k] = z[k] - z_measured[k];
  }
};

// Log(q^* q), rad: the full rotation error of a spherical joint.
struct RotationResidual {
  static constexpr int kSize = 3;
  static constexpr int kDof = 3;
  int q_index;

  template <typename T>
  void operator()(const PredictedState<T>& state, const double* measured,
                  T* r) const {
    const T* q = state.q + q_index;
    const Vector3<T> phi =
        Log(Multiply(Quaternion<T>(T(measured[3]), T(-measured[0]),
                                   T(-measured[1]), T(-measured[2])),
                     Quaternion<T>(q[3], q[0], q[1], q[2])));
    for (int k = 0; k < 3; ++k) r[k] = phi[k];
  }
};

// q - q^ of a slide, m.
struct PositionResidual {
  static constexpr int kSize = 1;
  static constexpr int kDof = 1;
  int q_index;
  SensedAt at = SensedAt::kJoint;

  template <typename T>
  void operator()(const PredictedState<T>& state, const double* measured,
                  T* r) const {
    r[0] = state.Position(q_index, at) - measured[0];
  }
};

// qd - qd^ of a joint with so many numbers.
template <int kNumbers>
struct VelocityResidualOf {
  static constexpr int kSize = kNumbers;
  static constexpr int kDof = kNumbers;
  int v_index;

  template <typename T>
  void operator()(const PredictedState<T>& state, const double* measured,
                  T* r) const {
    for (int k = 0; k < kSize; ++k) r[k] = state.qd[v_index + k] - measured[k];
  }
};
using VelocityResidual = VelocityResidualOf<1>;         // rad/s or m/s
using AngularVelocityResidual = VelocityResidualOf<3>;  // child's axes, rad/s

// p_WL - p^, m, of a link's origin along so many of the world's axes.
template <int kNumbers>
struct FramePositionResidual {
  static constexpr int kSize = kNumbers;
  static constexpr int kDof = kNumbers;
  int link;
  std::array<int, kNumbers> axes;

  template <typename T>
  void operator()(const PredictedState<T>& state, const double* measured,
                  T* r) const {
    const Vector3<T> p = LinkPosition<T>(*state.workspace, link);
    for (int k = 0; k < kSize; ++k) r[k] = p[axes[k]] - measured[k];
  }
};

// The closed list: one line a residual.
using ChannelResidual =
    std::variant<PlanarHeadingResidual, HeadingResidual, RotationResidual,
                 PositionResidual, VelocityResidual, AngularVelocityResidual,
                 FramePositionResidual<1>, FramePositionResidual<2>,
                 FramePositionResidual<3>>;

// What a spherical joint's orientation is compared by (flag --residual).
enum class OrientationResidual { kHeading, kRotation };

ChannelResidual MakeChannelResidual(const Mechanism& mechanism,
                                    const Channel& channel,
                                    OrientationResidual orientation);

int ResidualSize(const ChannelResidual& residual);
int ResidualDof(const ChannelResidual& residual);
// Unit of the error: "rad", "m", "rad/s", "m/s".
std::string ResidualUnit(const Mechanism& mechanism, const Channel& channel);
// Whether a channel tells of positions (not of velocities).
bool IsPositionLike(ChannelKind kind);

}  // namespace sysid
