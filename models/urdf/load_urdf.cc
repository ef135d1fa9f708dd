#include "models/urdf/load_urdf.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>

#include "glog/logging.h"
#include "models/error.h"
#include "models/hold_joints.h"
#include "models/urdf/rpy.h"
#include "models/urdf/urdf_outline.h"
#include "models/urdf/urdf_tree.h"
#include "models/urdf/urdfdom.h"

namespace sysid {
namespace {

Eigen::Vector3d ToEigen(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

Joint ToJoint(const urdf::Joint& from, const UrdfJoint& outline,
              int parent_link) {
  Joint joint;
  joint.name = from.name;
  joint.type = outline.type;  // urdfdom calls spherical joints floating
  joint.parent_link = parent_link;
  joint.mimic = outline.mimic;
  joint.R_PJ = RotationOf(outline.rpy);
  if (IsRotation1(joint.type) || joint.type == JointType::kPrismatic) {
    joint.axis = ToEigen(from.axis);
    joint.axis_length = outline.axis_length;
  }
  if (from.dynamics) {
    joint.damping = from.dynamics->damping;
    joint.friction = from.dynamics->friction;
  }
  joint.has_limits = outline.has_limits;
  if (joint.has_limits) {
    joint.lower = outline.lower;
    joint.upper = outline.upper;
    joint.effort_limit = outline.effort;
    joint.velocity_limit = outline.velocity;
  }
  return joint;
}

// Mimics of joints that are fixed stay where those put them.
Mechanism HoldMimicsOfFixed(const Mechanism& mechanism) {
  std::map<int, double> positions;
  for (size_t i = 0; i < mechanism.joints.size(); ++i) {
    const Joint& joint = mechanism.joints[i];
    if (!joint.mimic || joint.type == JointType::kFixed) continue;
    const Followed followed = FollowedBy(mechanism, static_cast<int>(i));
    if (mechanism.joints[followed.joint].type != JointType::kFixed) continue;
    positions[static_cast<int>(i)] = followed.offset;
  }
  return positions.empty() ? mechanism : HoldJoints(mechanism, positions);
}

constexpr size_t kMostText = size_t{64} << 20;

}  // namespace

Mechanism LoadUrdf(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    throw InputError(path, "is a folder, not a URDF file", "name a file in it");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw InputError(path,
                     std::string("cannot be read: ") + std::strerror(errno),
                     "give a URDF file or the name of a shipped model");
  }
  std::string text;
  std::vector<char> chunk(1 << 16);
  // Text has no NUL: stops there, for /dev/zero has no end.
  for (size_t read = 0; file && text.find('\0', read) == std::string::npos;) {
    read = text.size();
    if (read > kMostText) {
      throw InputError(path, "is larger than 64 MiB",
                       "is this the URDF that you mean? Meshes stand in files "
                       "of their own");
    }
    file.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
    text.append(chunk.data(), static_cast<size_t>(file.gcount()));
  }
  return LoadUrdfText(text, path);
}

Mechanism LoadUrdfText(const std::string& text, const std::string& path) {
  const UrdfOutline outline = ReadUrdfOutline(text, path);
  const urdf::ModelInterfaceSharedPtr urdf =
      ParseWithUrdfdom(TextForUrdfdom(outline), path);
  Mechanism mechanism;
  mechanism.name = urdf->getName();
  std::vector<int> index(outline.links.size(), -1);  // of the outline's links
  index[outline.root] = mechanism.AddRoot(outline.links[outline.root].name);
  mechanism.nominal.links[0] = InertialOf(outline.links[outline.root]);
  for (int j : ParentsFirst(outline)) {
    const UrdfJoint& joint = outline.joints[j];
    const urdf::JointConstSharedPtr from = urdf->getJoint(joint.name);
    const urdf::LinkConstSharedPtr child =
        urdf->getLink(outline.links[joint.child].name);
    CHECK(from && child) << joint.name;
    const int added = mechanism.AddJoint(
        ToJoint(*from, joint, index[joint.parent]), child->name,
        ToEigen(from->parent_to_joint_origin_transform.position),
        InertialOf(outline.links[joint.child]));
    index[joint.child] = mechanism.joints[added].child_link;
  }
  mechanism.source = std::make_shared<const std::string>(text);
  return HoldMimicsOfFixed(mechanism);
}

}  // namespace sysid
