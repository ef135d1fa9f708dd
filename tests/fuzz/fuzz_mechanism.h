#pragma once

#include "models/mechanism.h"

namespace sysid {

// A hinge, a slide, a ball joint and a frame behind them: every kind of column
// that a run can have. Never destroyed.
inline const Mechanism& FuzzMechanism() {
  static const Mechanism& mechanism = *[] {
    auto* made = new Mechanism;
    made->name = "fuzz";
    int parent = made->AddRoot("world");
    Inertial<double> inertial;
    inertial.mass = 1.0;
    inertial.inertia = Eigen::Matrix3d::Identity() * 0.01;
    const auto add = [&](const char* name, JointType type, const char* link) {
      Joint joint;
      joint.name = name;
      joint.type = type;
      joint.parent_link = parent;
      parent = made->joints[made->AddJoint(joint, link, {0, 0, -1}, inertial)]
                   .child_link;
    };
    add("a", JointType::kRevolute, "link_a");
    add("s", JointType::kPrismatic, "link_s");
    add("b", JointType::kSpherical, "link_b");
    add("f", JointType::kFixed, "tip");
    return made;
  }();
  return mechanism;
}

}  // namespace sysid
