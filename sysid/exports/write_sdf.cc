#include "sysid/exports/write_sdf.h"

#include <algorithm>
#include <cmath>

#include "models/urdf/rpy.h"
#include "models/urdf/urdf_xml.h"
#include "sysid/exports/xml.h"

namespace sysid {
namespace {

const char* SdfType(JointType type) {
  switch (type) {
    case JointType::kFixed:
      return "fixed";
    case JointType::kRevolute:
      return "revolute";
    case JointType::kContinuous:
      return "continuous";
    case JointType::kPrismatic:
      return "prismatic";
    default:
      return "ball";
  }
}

void WritePose(const Eigen::Vector3d& p, const Eigen::Matrix3d& R,
               const std::string& relative_to, TiXmlElement* parent) {
  Eigen::VectorXd pose(6);
  pose << p, RollPitchYaw(R);
  TiXmlElement* element = AppendText(parent, "pose", NumbersText(pose));
  if (!relative_to.empty()) SetText(element, "relative_to", relative_to);
}

void WriteInertial(const Inertial<double>& body, TiXmlElement* link) {
  TiXmlElement* inertial = AppendElement(link, "inertial");
  WritePose(body.com, Eigen::Matrix3d::Identity(), "", inertial);
  AppendText(inertial, "mass", ExactText(body.mass));
  TiXmlElement* inertia = AppendElement(inertial, "inertia");
  static constexpr struct {
    const char* name;
    int row, column;
  } kMoments[] = {{"ixx", 0, 0}, {"ixy", 0, 1}, {"ixz", 0, 2},
                  {"iyy", 1, 1}, {"iyz", 1, 2}, {"izz", 2, 2}};
  for (const auto& m : kMoments) {
    AppendText(inertia, m.name, ExactText(body.inertia(m.row, m.column)));
  }
}

class SdfWriter {
 public:
  SdfWriter(const Model& model, const ExportData& data)
      : model_(model),
        mechanism_(model.mechanism()),
        values_(model),
        data_(data) {}

  ExportText Write(const std::vector<std::string>& comments) {
    document_.LinkEndChild(new TiXmlDeclaration("1.0", "", ""));
    TiXmlElement* sdf = AppendElement(&document_, "sdf");
    SetText(sdf, "version", "1.9");
    SetText(sdf, "xmlns:drake", "http://drake.mit.edu");
    robot_ = AppendElement(sdf, "model");
    SetText(robot_, "name", mechanism_.name);
    AppendComments(robot_, comments);
    const std::string& root = mechanism_.links[0].name;
    if (root != "world") {
      WriteLink(0, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity(), "");
      TiXmlElement* fixed = AppendElement(robot_, "joint");
      SetText(fixed, "name", root + "_to_world");
      SetText(fixed, "type", "fixed");
      AppendText(fixed, "parent", "world");
      AppendText(fixed, "child", root);
    }
    for (size_t i = 0; i < mechanism_.joints.size(); ++i) {
      const Joint& joint = mechanism_.joints[i];
      Eigen::Vector3d p = model_.nominal().joint_p[i];
      if (joint.held) {
        p += joint.held->slide;
        notes_.push_back("joint '" + joint.name + "' is held at " +
                         ExactText(joint.held->position) +
                         ": it is fixed there");
      }
      const std::string& parent = mechanism_.links[joint.parent_link].name;
      WriteLink(joint.child_link, p, joint.R_PJ,
                parent == "world" ? "" : parent);
      WriteJoint(joint);
    }
    return {Printed(document_), "", notes_};
  }

 private:
  double Of(const Joint& joint, const char* parameter) const {
    return values_(joint.name + "." + parameter);
  }

  void WriteLink(int index, const Eigen::Vector3d& p, const Eigen::Matrix3d& R,
                 const std::string& parent) {
    TiXmlElement* link = AppendElement(robot_, "link");
    SetText(link, "name", mechanism_.links[index].name);
    WritePose(p, R, parent, link);
    WriteInertial(model_.nominal().links[index], link);
  }

  void WriteJoint(const Joint& joint) {
    TiXmlElement* element = AppendElement(robot_, "joint");
    SetText(element, "name", joint.name);
    SetText(element, "type", SdfType(joint.type));
    AppendText(element, "parent", mechanism_.links[joint.parent_link].name);
    AppendText(element, "child", mechanism_.links[joint.child_link].name);
    if (joint.type == JointType::kFixed ||
        joint.type == JointType::kSpherical) {
      return;
    }
    TiXmlElement* axis = AppendElement(element, "axis");
    AppendText(axis, "xyz", NumbersText(joint.axis));
    WriteLimit(joint, axis);
    WriteDynamics(joint, axis);
    if (joint.mimic) WriteMimic(joint, axis, element);
    const double rotor = Of(joint, "armature");
    if (rotor > 0.0) {
      AppendText(element, "drake:rotor_inertia", ExactText(rotor));
      AppendText(element, "drake:gear_ratio", "1");
    }
  }

  void WriteLimit(const Joint& joint, TiXmlElement* axis) {
    const std::string name = joint.name + ".effort_limit";
    const bool beyond =
        std::find(data_.beyond_limits.begin(), data_.beyond_limits.end(),
                  joint.name) != data_.beyond_limits.end();
    const bool bounded = joint.has_limits && joint.lower < joint.upper &&
                         joint.type != JointType::kContinuous;
    TiXmlElement* limit = AppendElement(axis, "limit");
    AppendText(limit, "lower",
               bounded && !beyond ? ExactText(joint.lower) : "-inf");
    AppendText(limit, "upper",
               bounded && !beyond ? ExactText(joint.upper) : "inf");
    if (bounded && beyond) {
      notes_.push_back("joint '" + joint.name +
                       "' was recorded beyond its limits, which are left out");
    }
    double effort = joint.effort_limit;
    if (values_.Has(name)) effort = values_(name);
    if (effort > 0.0 && std::isfinite(effort)) {
      AppendText(limit, "effort", ExactText(effort));
    }
    if (joint.velocity_limit > 0.0 && std::isfinite(joint.velocity_limit)) {
      AppendText(limit, "velocity", ExactText(joint.velocity_limit));
    }
  }

  void WriteDynamics(const Joint& joint, TiXmlElement* axis) {
    TiXmlElement* dynamics = AppendElement(axis, "dynamics");
    AppendText(dynamics, "damping", ExactText(Of(joint, "damping")));
    AppendText(dynamics, "friction", ExactText(Of(joint, "friction")));
    AppendText(dynamics, "spring_reference",
               ExactText(Of(joint, "spring_reference")));
    AppendText(dynamics, "spring_stiffness", ExactText(Of(joint, "stiffness")));
  }

  void WriteMimic(const Joint& joint, TiXmlElement* axis,
                  TiXmlElement* element) {
    const Mimic& mimic = *joint.mimic;
    TiXmlElement* follows = AppendElement(axis, "mimic");
    SetText(follows, "joint", mimic.joint);
    AppendText(follows, "multiplier", ExactText(mimic.multiplier));
    AppendText(follows, "offset", ExactText(mimic.offset));
    AppendText(follows, "reference", "0");
    TiXmlElement* drakes = AppendElement(element, "drake:mimic");
    SetText(drakes, "joint", mimic.joint);
    SetNumber(drakes, "multiplier", mimic.multiplier);
    SetNumber(drakes, "offset", mimic.offset);
  }

  const Model& model_;
  const Mechanism& mechanism_;
  const EffectValues values_;
  const ExportData& data_;
  TiXmlDocument document_;
  TiXmlElement* robot_ = nullptr;
  std::vector<std::string> notes_;
};

}  // namespace

ExportText WriteSdf(const Model& model, const ExportData& data,
                    const std::vector<std::string>& comments) {
  return SdfWriter(model, data).Write(comments);
}

}  // namespace sysid
