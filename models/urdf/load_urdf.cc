#include "models/urdf/load_urdf.h"

#include <Eigen/Geometry>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "glog/logging.h"
#include "models/error.h"
#include "models/urdf/urdf_outline.h"
#include "models/urdf/urdf_tree.h"
#include "models/urdf/urdfdom.h"

namespace sysid {
namespace {

Eigen::Vector3d ToEigen(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

// Roll, pitch, yaw about fixed axes, rad. Not by urdfdom's quaternion, which
// costs a digit: what write_urdf.h writes must come back.
Eigen::Matrix3d RotationOf(const double* rpy) {
  return (Eigen::AngleAxisd(rpy[2], Eigen::Vector3d::UnitZ())
              .toRotationMatrix() *
          Eigen::AngleAxisd(rpy[1], Eigen::Vector3d::UnitY())
              .toRotationMatrix()) *
         Eigen::AngleAxisd(rpy[0], Eigen::Vector3d::UnitX()).toRotationMatrix();
}

Inertial<double> ToInertial(const urdf::Link& link, const UrdfLink& outline) {
  Inertial<double> body;
  if (!link.inertial) return body;
  const urdf::Inertial& from = *link.inertial;
  body.mass = from.mass;
  body.com = ToEigen(from.origin.position);
  Eigen::Matrix3d I;
  I << from.ixx, from.ixy, from.ixz,  //
      from.ixy, from.iyy, from.iyz,   //
      from.ixz, from.iyz, from.izz;
  const Eigen::Matrix3d R = RotationOf(outline.rpy);
  if (R == Eigen::Matrix3d::Identity()) {
    body.inertia = I;
  } else {
    const Eigen::Matrix3d turned = R * I * R.transpose();
    body.inertia = 0.5 * (turned + turned.transpose());
  }
  return body;
}

Joint ToJoint(const urdf::Joint& from, const UrdfJoint& outline,
              int parent_link) {
  Joint joint;
  joint.name = from.name;
  joint.type = outline.type;  // urdfdom calls spherical joints floating
  joint.parent_link = parent_link;
  joint.R_PJ = RotationOf(outline.rpy);
  if (IsRotation1(joint.type) || joint.type == JointType::kPrismatic) {
    joint.axis = ToEigen(from.axis);
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
  mechanism.nominal.links[0] =
      ToInertial(*urdf->getRoot(), outline.links[outline.root]);
  for (int j : ParentsFirst(outline)) {
    const UrdfJoint& joint = outline.joints[j];
    const urdf::JointConstSharedPtr from = urdf->getJoint(joint.name);
    const urdf::LinkConstSharedPtr child =
        urdf->getLink(outline.links[joint.child].name);
    CHECK(from && child) << joint.name;
    const int added = mechanism.AddJoint(
        ToJoint(*from, joint, index[joint.parent]), child->name,
        ToEigen(from->parent_to_joint_origin_transform.position),
        ToInertial(*child, outline.links[joint.child]));
    index[joint.child] = mechanism.joints[added].child_link;
  }
  return mechanism;
}

}  // namespace sysid
