#include "models/hold_joints.h"

#include <Eigen/Geometry>

#include "glog/logging.h"

namespace sysid {
namespace {

// Makes the joint fixed, whatever it was; `joint` is of no mechanism yet.
void HoldStill(double position, Joint* joint) {
  if (joint->held) {  // elsewhere, so far
    joint->type = joint->held->type;
    joint->R_PJ = joint->held->R_PJ;
  }
  HeldJoint held;
  held.type = joint->type;
  held.position = position;
  held.R_PJ = joint->R_PJ;
  if (IsRotation1(joint->type)) {
    // At zero to the last bit as the file has it.
    if (position != 0.0) {
      joint->R_PJ = joint->R_PJ *
                    Eigen::AngleAxisd(position, joint->axis).toRotationMatrix();
    }
  } else if (joint->type == JointType::kPrismatic) {
    held.slide = joint->R_PJ * joint->axis * position;
  } else {
    CHECK_EQ(position, 0.0) << joint->name;
  }
  joint->type = JointType::kFixed;
  joint->held = held;
}

}  // namespace

Mechanism HoldJoints(const Mechanism& mechanism,
                     const std::map<int, double>& positions) {
  std::map<int, double> held = positions;
  // A mimic may follow a mimic, before or behind it in the order of the file.
  for (bool more = true; more;) {
    more = false;
    for (size_t i = 0; i < mechanism.joints.size(); ++i) {
      const std::optional<Mimic>& mimic = mechanism.joints[i].mimic;
      if (!mimic || held.contains(static_cast<int>(i))) continue;
      const auto leader = held.find(mechanism.FindJoint(mimic->joint));
      if (leader == held.end()) continue;
      held[static_cast<int>(i)] =
          mimic->multiplier * leader->second + mimic->offset;
      more = true;
    }
  }
  Mechanism out;
  out.name = mechanism.name;
  out.source = mechanism.source;
  out.AddRoot(mechanism.links[0].name);
  for (size_t i = 0; i < mechanism.joints.size(); ++i) {
    Joint joint = mechanism.joints[i];
    const auto at = held.find(static_cast<int>(i));
    if (at != held.end()) HoldStill(at->second, &joint);
    out.AddJoint(joint, mechanism.links[joint.child_link].name,
                 mechanism.nominal.joint_p[i],
                 mechanism.nominal.links[joint.child_link]);
  }
  out.nominal = mechanism.nominal;
  return out;
}

}  // namespace sysid
