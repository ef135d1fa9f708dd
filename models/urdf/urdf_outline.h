#pragma once

#include <optional>
#include <string>
#include <vector>

#include "models/mechanism.h"

namespace sysid {

// What the loader needs of a URDF beside what urdfdom keeps: the order of the
// file, the spherical joints, and every number read by us. urdfdom sorts by
// name, takes unreadable numbers for 0 and "1.0abc" for 1, and does not know
// spherical joints.
struct UrdfLink {
  std::string name;
  int row = 0, column = 0;
  bool has_inertial = false;
  double mass = 0;            // kg
  double xyz[3] = {0, 0, 0};  // centre of mass in link axes, m
  double rpy[3] = {0, 0, 0};  // axes of the inertia in link axes, rad
  // ixx ixy ixz iyy iyz izz about the centre of mass, kg m^2.
  double inertia[6] = {0, 0, 0, 0, 0, 0};
};

struct UrdfJoint {
  std::string name;
  int row = 0, column = 0;
  JointType type = JointType::kFixed;
  bool type_known = true;  // else a fault
  int parent = -1;         // indices of links
  int child = -1;
  double xyz[3] = {0, 0, 0};   // p_PJ, m
  double rpy[3] = {0, 0, 0};   // R_PJ, rad
  double axis[3] = {1, 0, 0};  // URDF's default; of unit length
  double axis_length = 1;      // in the file
  double damping = 0, friction = 0;
  bool has_limits = false;
  double lower = 0, upper = 0;
  double effort = 0, velocity = 0;  // infinity where the file says nothing
  std::optional<Mimic> mimic;
  int mimic_row = 0, mimic_column = 0;
};

// Links and joints in the order of the file; joints form a tree.
struct UrdfOutline {
  std::string robot_name;
  int root = -1;
  std::vector<UrdfLink> links;
  std::vector<UrdfJoint> joints;
};

// Reads and checks everything that the dynamics use. Throws InputError with
// every fault; load_urdf.h lists the checks.
UrdfOutline ReadUrdfOutline(const std::string& text, const std::string& path);

// The link's body in its axes.
Inertial<double> InertialOf(const UrdfLink& link);

}  // namespace sysid
