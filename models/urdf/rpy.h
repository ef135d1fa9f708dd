#pragma once

#include <Eigen/Geometry>
#include <cmath>

namespace sysid {

// Roll, pitch, yaw about fixed axes, rad: R = Rz(yaw) Ry(pitch) Rx(roll).

// Not by urdfdom's quaternion, which costs a digit: what write_urdf.h writes
// must come back.
inline Eigen::Matrix3d RotationOf(const double* rpy) {
  return (Eigen::AngleAxisd(rpy[2], Eigen::Vector3d::UnitZ())
              .toRotationMatrix() *
          Eigen::AngleAxisd(rpy[1], Eigen::Vector3d::UnitY())
              .toRotationMatrix()) *
         Eigen::AngleAxisd(rpy[0], Eigen::Vector3d::UnitX()).toRotationMatrix();
}

// Roll is taken after yaw is undone, so that the two agree where pitch is a
// quarter turn and only their sum shows.
inline Eigen::Vector3d RollPitchYaw(const Eigen::Matrix3d& R) {
  const double yaw = std::atan2(R(1, 0), R(0, 0));
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  const double s = std::sin(yaw), c = std::cos(yaw);
  const double roll =
      std::atan2(s * R(0, 2) - c * R(1, 2), c * R(1, 1) - s * R(0, 1));
  return {roll, pitch, yaw};
}

}  // namespace sysid
