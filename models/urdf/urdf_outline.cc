#include "models/urdf/urdf_outline.h"

#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "models/error.h"
#include "models/printable.h"
#include "models/urdf/rpy.h"
#include "models/urdf/urdf_tree.h"
#include "models/urdf/urdf_xml.h"

namespace sysid {
namespace {

std::string Line(int row) { return "line " + std::to_string(row); }

// "link 'arm'", or "link without a name".
std::string Called(const std::string& kind, const std::string& name) {
  return name.empty() ? kind + " without a name" : kind + " '" + name + "'";
}

// Names stand in tables on terminals, in CSV and in other files' lines.
void CheckName(const UrdfElement& element) {
  if (HasControls(element.Text("name"))) {
    element.FaultAt("name", "a control character in the name", "leave it out");
  }
}

// Name of a link or a joint, unique among those at `seen` (name -> row).
std::string ReadName(const UrdfElement& element, const std::string& kind,
                     std::map<std::string, int>* seen) {
  const std::string name = element.Text("name");
  if (name.empty()) {
    element.Fault("every " + kind + " needs one",
                  "<" + kind + " name=\"...\">");
    return name;
  }
  CheckName(element);
  const auto [first, is_new] = seen->insert({name, element.xml()->Row()});
  if (!is_new) {
    element.FaultAt("name",
                    "the name is used twice, first in " + Line(first->second));
  }
  return name;
}

void ReadInertial(const UrdfElement& inertial, UrdfLink* link) {
  link->has_inertial = true;
  inertial.CheckChildren({"origin", "mass", "inertia"});
  inertial.Origin(link->xyz, link->rpy);
  const UrdfElement mass = inertial.Child("mass");
  if (!mass.exists()) {
    inertial.Fault("<inertial> has no <mass>", "<mass value=\"kg\"/>");
  } else {
    mass.RequiredNumber("value", &link->mass);
  }
  const UrdfElement inertia = inertial.Child("inertia");
  if (!inertia.exists()) {
    inertial.Fault("<inertial> has no <inertia>",
                   "six numbers about the centre of mass; zeros make a point "
                   "mass");
    return;
  }
  static constexpr const char* kMoments[] = {"ixx", "ixy", "ixz",
                                             "iyy", "iyz", "izz"};
  for (int i = 0; i < 6; ++i) {
    inertia.RequiredNumber(kMoments[i], &link->inertia[i]);
  }
}

std::optional<JointType> ReadType(const UrdfElement& joint) {
  const std::string type = joint.Text("type");
  if (type.empty()) {
    joint.Fault("no type", "type=\"revolute\", for example");
    return {};
  }
  std::vector<std::string> known;
  for (JointType t :
       {JointType::kRevolute, JointType::kContinuous, JointType::kPrismatic,
        JointType::kSpherical, JointType::kFixed}) {
    if (type == ToString(t)) return t;
    known.push_back(ToString(t));
  }
  if (type == "planar") {
    joint.FaultAt("type", "planar joints are not supported",
                  "use two prismatic joints and a revolute one, each carrying "
                  "a part of the mass");
  } else if (type == "floating") {
    joint.FaultAt("type", "floating joints are not supported",
                  "the root link is fixed in the world");
  } else {
    joint.FaultAt("type", "unknown joint type '" + type + "'",
                  NameHint(type, known));
  }
  return {};
}

// The link that <parent link="..."> or <child link="..."> names, or -1.
int ReadEnd(const UrdfElement& joint, const char* which,
            const std::vector<UrdfLink>& links) {
  const UrdfElement end = joint.Child(which);
  if (!end.exists() || end.Text("link").empty()) {
    (end.exists() ? end : joint)
        .Fault(std::string("no ") + which + " link",
               std::string("<") + which + " link=\"...\"/>");
    return -1;
  }
  const std::string name = end.Text("link");
  std::vector<std::string> names;
  for (size_t i = 0; i < links.size(); ++i) {
    if (links[i].name == name) return static_cast<int>(i);
    names.push_back(links[i].name);
  }
  end.FaultAt(
      "link",
      "the " + std::string(which) + " link '" + name + "' is not in the file",
      NameHint(name, names));
  return -1;
}

void ReadAxis(const UrdfElement& element, UrdfJoint* joint) {
  const UrdfElement axis = element.Child("axis");
  if (!axis.exists()) return;
  axis.CheckAttributes({"xyz"});
  if (!axis.Has("xyz")) {
    axis.Fault("<axis> has no xyz", "<axis xyz=\"0 0 1\"/>");
    return;
  }
  if (!axis.Vector3("xyz", joint->axis)) return;
  Eigen::Map<Eigen::Vector3d> vector(joint->axis);
  const double norm = vector.norm();
  if (norm == 0) {
    axis.FaultAt("xyz", "the axis is zero",
                 "it is the direction about or along which the joint moves");
  } else if (std::abs(norm - 1) > 1e-14) {
    vector /= norm;
    joint->axis_length = norm;
  }
}

void ReadDynamics(const UrdfElement& element, UrdfJoint* joint) {
  const UrdfElement dynamics = element.Child("dynamics");
  if (!dynamics.exists()) return;
  dynamics.CheckAttributes({"damping", "friction"});
  dynamics.Number("damping", &joint->damping);
  dynamics.Number("friction", &joint->friction);
}

void ReadLimits(const UrdfElement& element, UrdfJoint* joint) {
  joint->effort = joint->velocity = std::numeric_limits<double>::infinity();
  const UrdfElement limit = element.Child("limit");
  if (!limit.exists()) return;
  limit.CheckAttributes({"lower", "upper", "effort", "velocity"});
  joint->has_limits = true;
  limit.Number("lower", &joint->lower);
  limit.Number("upper", &joint->upper);
  limit.Number("effort", &joint->effort);
  limit.Number("velocity", &joint->velocity);
}

void ReadMimic(const UrdfElement& element, UrdfJoint* joint) {
  const UrdfElement mimic = element.Child("mimic");
  if (!mimic.exists()) return;
  mimic.CheckAttributes({"joint", "multiplier", "offset"});
  Mimic read;
  read.joint = mimic.Text("joint");
  if (read.joint.empty()) {
    mimic.Fault("<mimic> has no joint", "<mimic joint=\"...\"/>");
    return;
  }
  mimic.Number("multiplier", &read.multiplier);
  mimic.Number("offset", &read.offset);
  if (joint->type == JointType::kFixed) return;
  if (joint->type == JointType::kSpherical) {
    mimic.Fault("a spherical joint cannot follow another",
                "joints of one degree of freedom can");
    return;
  }
  joint->mimic = read;
  joint->mimic_row = mimic.xml()->Row();
  joint->mimic_column = mimic.xml()->Column();
}

// That the joints which others follow are there, have one degree of freedom or
// none, and lead to one that follows no other.
void CheckMimics(const std::vector<UrdfJoint>& joints, UrdfFaults* faults) {
  std::map<std::string, const UrdfJoint*> by_name;
  std::vector<std::string> names;
  for (const UrdfJoint& joint : joints) {
    by_name[joint.name] = &joint;
    names.push_back(joint.name);
  }
  for (const UrdfJoint& joint : joints) {
    if (!joint.mimic) continue;
    const auto fault = [&](const std::string& what, const std::string& hint) {
      faults->Add(joint.mimic_row, joint.mimic_column,
                  Called("joint", joint.name) + ": " + what, hint);
    };
    const UrdfJoint* at = &joint;
    for (size_t steps = 0; at && at->mimic; ++steps) {
      if (steps == joints.size()) {
        fault("follows joints that follow each other",
              "one of them moves by itself: leave its <mimic> out");
        break;
      }
      const auto next = by_name.find(at->mimic->joint);
      if (next == by_name.end()) {
        // Of one that is followed it is said there.
        if (at == &joint) {
          fault("follows joint '" + at->mimic->joint +
                    "', which is not in the file",
                NameHint(at->mimic->joint, names));
        }
        at = nullptr;
      } else {
        at = next->second;
      }
    }
    if (at && at->type == JointType::kSpherical) {
      fault("follows joint '" + at->name + "', which is spherical",
            "a joint can follow one of one degree of freedom");
    }
  }
}

UrdfLink ReadLink(const TiXmlElement* xml, std::map<std::string, int>* seen,
                  UrdfFaults* faults) {
  UrdfLink link;
  link.row = xml->Row();
  link.column = xml->Column();
  const UrdfElement named(
      xml, Called("link", UrdfElement(xml, "", faults).Text("name")), faults);
  link.name = ReadName(named, "link", seen);
  named.CheckChildren({"inertial", "visual", "collision"});
  const UrdfElement inertial = named.Child("inertial");
  if (inertial.exists()) ReadInertial(inertial, &link);
  return link;
}

UrdfJoint ReadJoint(const TiXmlElement* xml, const std::vector<UrdfLink>& links,
                    std::map<std::string, int>* seen, UrdfFaults* faults) {
  UrdfJoint joint;
  joint.row = xml->Row();
  joint.column = xml->Column();
  const UrdfElement named(
      xml, Called("joint", UrdfElement(xml, "", faults).Text("name")), faults);
  joint.name = ReadName(named, "joint", seen);
  named.CheckAttributes({"name", "type"});
  named.CheckChildren({"origin", "parent", "child", "axis", "limit", "dynamics",
                       "mimic", "calibration", "safety_controller"});
  const std::optional<JointType> type = ReadType(named);
  joint.type_known = type.has_value();
  joint.type = type.value_or(JointType::kFixed);
  joint.parent = ReadEnd(named, "parent", links);
  joint.child = ReadEnd(named, "child", links);
  named.Origin(joint.xyz, joint.rpy);
  const bool axis_counts = !joint.type_known || IsRotation1(joint.type) ||
                           joint.type == JointType::kPrismatic;
  if (axis_counts) ReadAxis(named, &joint);
  ReadLimits(named, &joint);
  if (joint.type != JointType::kFixed) ReadDynamics(named, &joint);
  ReadMimic(named, &joint);
  return joint;
}

// Far beyond any machine; the work and the memory of the dynamics grow with the
// square of the joints.
void CheckCount(const TiXmlElement* robot, const std::string& path) {
  constexpr int kMostJoints = 1000;
  int joints = 0;
  for (const TiXmlElement* xml = robot->FirstChildElement("joint"); xml;
       xml = xml->NextSiblingElement("joint")) {
    ++joints;
  }
  if (joints <= kMostJoints) return;
  throw InputError(path,
                   std::to_string(joints) + " joints; " +
                       std::to_string(kMostJoints) + " are the most",
                   "leave out what moves with another link anyway");
}

}  // namespace

UrdfOutline ReadUrdfOutline(const std::string& text, const std::string& path) {
  TiXmlDocument document;
  const TiXmlElement* robot = ParseRobot(text, path, &document);
  CheckCount(robot, path);
  UrdfFaults faults(path);
  const UrdfElement top(robot, "robot", &faults);
  UrdfOutline outline;
  outline.robot_name = top.Text("name");
  if (outline.robot_name.empty()) {
    top.Fault("no name", "<robot name=\"...\">");
  }
  CheckName(top);
  top.CheckChildren({"link", "joint", "material", "gazebo", "transmission"});
  std::map<std::string, int> link_names, joint_names;
  for (const TiXmlElement* xml = robot->FirstChildElement("link"); xml;
       xml = xml->NextSiblingElement("link")) {
    outline.links.push_back(ReadLink(xml, &link_names, &faults));
  }
  if (outline.links.empty()) top.Fault("no links");
  for (const TiXmlElement* xml = robot->FirstChildElement("joint"); xml;
       xml = xml->NextSiblingElement("joint")) {
    outline.joints.push_back(
        ReadJoint(xml, outline.links, &joint_names, &faults));
  }
  CheckMimics(outline.joints, &faults);
  CheckTree(&outline, &faults);
  faults.Throw();
  return outline;
}

Inertial<double> InertialOf(const UrdfLink& link) {
  Inertial<double> body;
  if (!link.has_inertial) return body;
  body.mass = link.mass;
  body.com = Eigen::Vector3d(link.xyz[0], link.xyz[1], link.xyz[2]);
  const double* from = link.inertia;
  Eigen::Matrix3d I;
  I << from[0], from[1], from[2],  //
      from[1], from[3], from[4],   //
      from[2], from[4], from[5];
  const Eigen::Matrix3d R = RotationOf(link.rpy);
  if (R == Eigen::Matrix3d::Identity()) {
    body.inertia = I;
  } else {
    const Eigen::Matrix3d turned = R * I * R.transpose();
    body.inertia = 0.5 * (turned + turned.transpose());
  }
  return body;
}

}  // namespace sysid
