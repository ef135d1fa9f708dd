#pragma once

#include <cmath>

#include "models/math/rotation.h"
#include "models/model.h"

namespace sysid {

// The motion of a body's joint as a person draws it.
struct JointMotion {
  double position = 0.0;     // rad or m; spherical: tilt of the link's axis
  Eigen::VectorXd velocity;  // nv of the joint
};

// Of a state x = (q, qd); `axis`: the link's (LinkAxis).
inline JointMotion MotionAt(const Model& model, const Body& body,
                            const Eigen::Vector3d& axis, const double* x) {
  const double* q = x + model.layout().q(body);
  JointMotion motion;
  motion.velocity = Eigen::Map<const Eigen::VectorXd>(
      x + model.layout().qd(body), VelocitySize(body));
  motion.position = q[0];
  if (body.type == JointType::kSpherical) {
    const Eigen::Vector3d turned =
        ToMatrix(Eigen::Quaterniond(q[3], q[0], q[1], q[2])) * axis;
    motion.position = std::atan2(axis.cross(turned).norm(), axis.dot(turned));
  }
  return motion;
}

}  // namespace sysid
