#pragma once

#include <string>

#include "models/mechanism.h"

namespace sysid {

// A mechanism in which every effect finds a target.

inline Inertial<double> SomeBody() {
  Inertial<double> body;
  body.mass = 1.2;
  body.com = Eigen::Vector3d(0.1, -0.05, -0.3);
  body.inertia = Eigen::Vector3d(0.02, 0.03, 0.04).asDiagonal();
  return body;
}

inline void AddSomeJoint(const std::string& name, JointType type, int parent,
                         const std::string& link, const Inertial<double>& body,
                         Mechanism* mechanism) {
  Joint joint;
  joint.name = name;
  joint.type = type;
  joint.parent_link = parent;
  joint.axis = Eigen::Vector3d(2, 3, 6) / 7.0;
  mechanism->AddJoint(joint, link, {0.1, 0.2, -0.3}, body);
}

// A joint of every type, a massless frame (tip) and a link that is fixed to the
// world (stand).
inline Mechanism AllJoints() {
  Mechanism mechanism;
  mechanism.AddRoot("world_link");
  AddSomeJoint("bolt", JointType::kFixed, 0, "stand", SomeBody(), &mechanism);
  AddSomeJoint("slide", JointType::kPrismatic, 1, "car", SomeBody(),
               &mechanism);
  AddSomeJoint("ball", JointType::kSpherical, 2, "upper", SomeBody(),
               &mechanism);
  AddSomeJoint("hinge", JointType::kRevolute, 3, "lower", SomeBody(),
               &mechanism);
  AddSomeJoint("wheel", JointType::kContinuous, 2, "rim", SomeBody(),
               &mechanism);
  AddSomeJoint("mount", JointType::kFixed, 4, "payload", SomeBody(),
               &mechanism);
  AddSomeJoint("end", JointType::kFixed, 4, "tip", {}, &mechanism);
  return mechanism;
}

}  // namespace sysid
