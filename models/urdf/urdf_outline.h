#pragma once

#include <string>
#include <vector>

#include "models/mechanism.h"
#include "models/urdf/urdf_xml.h"

namespace sysid {

// What a URDF says of links and joints, each with its place in the file.
struct UrdfLink {
  std::string name;
  int row = 0, column = 0;
  bool has_inertial = false;
  Inertial<double> body;  // mass NaN where it is at fault
};

// parent_link and child_link are indices of the outline's links, -1 where they
// are at fault.
struct UrdfJoint : Joint {
  int row = 0, column = 0;
  bool type_known = true;  // else a fault
  Eigen::Vector3d p_PJ = Eigen::Vector3d::Zero();
};

// Links and joints in the order of the file.
struct UrdfOutline {
  std::string robot_name;
  int root = -1;  // once it is known to be a tree
  std::vector<UrdfLink> links;
  std::vector<UrdfJoint> joints;
};

// Reads and checks every element that the dynamics use; load_urdf.h lists the
// checks. Throws InputError where the text is no XML of a robot.
UrdfOutline ReadUrdfOutline(const std::string& text, const std::string& path,
                            UrdfFaults* faults);

}  // namespace sysid
