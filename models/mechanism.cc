#include "models/mechanism.h"

#include <algorithm>
#include <cmath>

#include "glog/logging.h"

namespace sysid {
namespace {

template <class Named>
int Find(const std::vector<Named>& all, const std::string& name) {
  const auto at = std::find_if(all.begin(), all.end(), [&](const Named& one) {
    return one.name == name;
  });
  return at == all.end() ? -1 : static_cast<int>(at - all.begin());
}

}  // namespace

int ConfigurationSize(JointType type) {
  if (type == JointType::kFixed) return 0;
  return type == JointType::kSpherical ? 4 : 1;
}

int VelocitySize(JointType type) {
  if (type == JointType::kFixed) return 0;
  return type == JointType::kSpherical ? 3 : 1;
}

int ConfigurationSize(const Joint& joint) {
  return joint.mimic ? 0 : ConfigurationSize(joint.type);
}

int VelocitySize(const Joint& joint) {
  return joint.mimic ? 0 : VelocitySize(joint.type);
}

bool IsRotation1(JointType type) {
  return type == JointType::kRevolute || type == JointType::kContinuous;
}

std::string ToString(JointType type) {
  switch (type) {
    case JointType::kFixed:
      return "fixed";
    case JointType::kRevolute:
      return "revolute";
    case JointType::kContinuous:
      return "continuous";
    case JointType::kPrismatic:
      return "prismatic";
    case JointType::kSpherical:
      return "spherical";
  }
  LOG(FATAL) << "not a joint type";
  return "";
}

int Mechanism::FindLink(const std::string& link_name) const {
  return Find(links, link_name);
}

int Mechanism::FindJoint(const std::string& joint_name) const {
  return Find(joints, joint_name);
}

int Mechanism::AddRoot(const std::string& link_name) {
  CHECK(links.empty()) << "the root is added first, once";
  links.push_back({link_name, {}});
  nominal.links.emplace_back();
  return 0;
}

int Mechanism::AddJoint(const Joint& joint, const std::string& child_link_name,
                        const Eigen::Vector3d& p_PJ,
                        const Inertial<double>& child) {
  const int index = static_cast<int>(joints.size());
  CHECK_GE(joint.parent_link, 0);
  CHECK_LT(joint.parent_link, static_cast<int>(links.size()));
  CHECK_LT(std::abs(joint.axis.norm() - 1.0), 1e-12) << joint.name;
  joints.push_back(joint);
  Joint& added = joints.back();
  added.child_link = index + 1;
  added.q_index = nq;
  added.v_index = nv;
  nq += ConfigurationSize(joint);
  nv += VelocitySize(joint);
  links[joint.parent_link].child_joints.push_back(index);
  links.push_back({child_link_name, {}});
  nominal.joint_p.push_back(p_PJ);
  nominal.links.push_back(child);
  return index;
}

Eigen::VectorXd Mechanism::NeutralConfiguration() const {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(nq);
  for (const Joint& joint : joints) {
    if (joint.type == JointType::kSpherical) q[joint.q_index + 3] = 1.0;
  }
  return q;
}

std::vector<std::string> Mechanism::JointNames() const {
  std::vector<std::string> names;
  for (const Joint& joint : joints) {
    if (VelocitySize(joint) > 0) names.push_back(joint.name);
  }
  return names;
}

std::vector<std::string> Mechanism::LinkNames() const {
  std::vector<std::string> names;
  for (const Link& link : links) names.push_back(link.name);
  return names;
}

Followed FollowedBy(const Mechanism& mechanism, int joint) {
  Followed followed{joint};
  while (const auto& mimic = mechanism.joints[followed.joint].mimic) {
    followed.joint = mechanism.FindJoint(mimic->joint);
    CHECK_GE(followed.joint, 0) << "no joint " << mimic->joint;
    followed.offset += followed.multiplier * mimic->offset;
    followed.multiplier *= mimic->multiplier;
  }
  return followed;
}

Eigen::Vector3d LinkAxis(const Mechanism& mechanism, int link) {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  if (!mechanism.links[link].child_joints.empty()) {
    direction =
        mechanism.nominal.joint_p[mechanism.links[link].child_joints.front()];
  }
  if (direction.norm() < 1e-9) direction = mechanism.nominal.links[link].com;
  if (direction.norm() < 1e-9) return Eigen::Vector3d::UnitZ();
  return direction.normalized();
}

double LinkLength(const Mechanism& mechanism,
                  const MechanismParameters<double>& parameters, int link) {
  const std::vector<int>& children = mechanism.links[link].child_joints;
  if (!children.empty()) return parameters.joint_p[children.front()].norm();
  return 2.0 * parameters.links[link].com.norm();
}

}  // namespace sysid
