#include "models/urdf/write_urdf.h"

#include <tinyxml.h>

#include <cmath>

#include "models/urdf/load_urdf.h"
#include "models/urdf/rpy.h"
#include "models/urdf/urdf_outline.h"
#include "models/urdf/urdf_xml.h"

namespace sysid {
namespace {

constexpr char kOurs[] = "sysid: ";  // begins our comments

// XML allows no "--" in a comment, nor a '-' at its end.
std::string Safe(const std::string& text) {
  std::string safe;
  for (char c : text) {
    if (c == '-' && !safe.empty() && safe.back() == '-') safe += ' ';
    safe += c;
  }
  return " " + safe + " ";
}

TiXmlElement* Append(TiXmlNode* parent, const std::string& name) {
  return parent->LinkEndChild(new TiXmlElement(name))->ToElement();
}

// The child of that name, which is there now.
TiXmlElement* Child(TiXmlElement* parent, const std::string& name) {
  TiXmlElement* child = parent->FirstChildElement(name);
  return child ? child : Append(parent, name);
}

// The element of a link or joint, or a new one.
TiXmlElement* NamedElement(TiXmlElement* robot, const char* kind,
                           const std::string& name) {
  for (TiXmlElement* e = robot->FirstChildElement(kind); e;
       e = e->NextSiblingElement(kind)) {
    const std::string* has = e->Attribute(std::string("name"));
    if (has && *has == name) return e;
  }
  TiXmlElement* added = Append(robot, kind);
  added->SetAttribute("name", name);
  return added;
}

template <class Part>
Part FindPart(const std::vector<Part>& parts, const std::string& name) {
  for (const Part& part : parts) {
    if (part.name == name) return part;
  }
  return {};
}

Eigen::Vector3d Vector(const double* v) { return {v[0], v[1], v[2]}; }

void WriteLink(const Inertial<double>& body, const UrdfLink& was,
               TiXmlElement* link) {
  const Inertial<double> before = InertialOf(was);
  const bool moved = body.com != before.com;
  const bool other = body.inertia != before.inertia;
  if (!moved && !other && body.mass == before.mass) return;
  TiXmlElement* inertial = Child(link, "inertial");
  if (moved || other) {
    TiXmlElement* origin = Child(inertial, "origin");
    if (moved) origin->SetAttribute("xyz", ExactText3(body.com.data()));
    if (other) origin->SetAttribute("rpy", "0 0 0");
  }
  if (!was.has_inertial || body.mass != before.mass) {
    Child(inertial, "mass")->SetAttribute("value", ExactText(body.mass));
  }
  if (was.has_inertial && !other) return;
  TiXmlElement* inertia = Child(inertial, "inertia");
  static constexpr struct {
    const char* name;
    int row, column;
  } kMoments[] = {{"ixx", 0, 0}, {"ixy", 0, 1}, {"ixz", 0, 2},
                  {"iyy", 1, 1}, {"iyz", 1, 2}, {"izz", 2, 2}};
  for (const auto& m : kMoments) {
    inertia->SetAttribute(m.name, ExactText(body.inertia(m.row, m.column)));
  }
}

// What <dynamics> says of the joint: by the effects of one that moves.
void FillDynamics(const Model& model, const Joint& joint, double* damping,
                  double* friction) {
  *damping = joint.held ? joint.damping : 0.0;
  *friction = joint.held ? joint.friction : 0.0;
  const EffectSet& effects = model.effects();
  for (int i = 0; i < effects.size(); ++i) {
    const Effect& effect = effects.effect(i);
    if (effect.target() != joint.name) continue;
    const double first = effect.parameters().empty()
                             ? 0.0
                             : model.nominal().effects[effects.offset(i)];
    if (effect.kind() == "viscous_damping") *damping = first;
    if (effect.kind() == "coulomb_friction") *friction = first;
  }
}

// Of an element that is new: what the file's would say already.
void WriteNewJoint(const Mechanism& mechanism, const Joint& joint,
                   TiXmlElement* element) {
  const auto& links = mechanism.links;
  Child(element, "parent")->SetAttribute("link", links[joint.parent_link].name);
  Child(element, "child")->SetAttribute("link", links[joint.child_link].name);
  if (joint.has_limits) {
    TiXmlElement* limit = Append(element, "limit");
    limit->SetAttribute("lower", ExactText(joint.lower));
    limit->SetAttribute("upper", ExactText(joint.upper));
    if (std::isfinite(joint.effort_limit)) {
      limit->SetAttribute("effort", ExactText(joint.effort_limit));
    }
    if (std::isfinite(joint.velocity_limit)) {
      limit->SetAttribute("velocity", ExactText(joint.velocity_limit));
    }
  }
  if (joint.mimic) {
    TiXmlElement* mimic = Append(element, "mimic");
    mimic->SetAttribute("joint", joint.mimic->joint);
    mimic->SetAttribute("multiplier", ExactText(joint.mimic->multiplier));
    mimic->SetAttribute("offset", ExactText(joint.mimic->offset));
  }
}

void WriteJoint(const Model& model, int index, const UrdfJoint& was,
                UrdfContent content, TiXmlElement* element) {
  Joint joint = model.mechanism().joints[index];
  Eigen::Vector3d p = model.nominal().joint_p[index];
  double damping = 0.0, friction = 0.0;
  if (joint.held && content == UrdfContent::kDynamics) {
    p += joint.held->slide;
    joint.mimic.reset();
  } else {
    FillDynamics(model, joint, &damping, &friction);
    if (joint.held) {
      joint.type = joint.held->type;
      joint.R_PJ = joint.held->R_PJ;
    }
  }
  const bool is_new = was.name.empty();
  if (is_new || joint.type != was.type) {
    element->SetAttribute("type", ToString(joint.type));
  }
  if (p != Vector(was.xyz)) {
    Child(element, "origin")->SetAttribute("xyz", ExactText3(p.data()));
  }
  if (joint.R_PJ != RotationOf(was.rpy)) {
    Child(element, "origin")
        ->SetAttribute("rpy", ExactText3(RollPitchYaw(joint.R_PJ).data()));
  }
  if (is_new) WriteNewJoint(model.mechanism(), joint, element);
  if (VelocitySize(joint.type) == 1 && joint.axis != Vector(was.axis)) {
    Child(element, "axis")->SetAttribute("xyz", ExactText3(joint.axis.data()));
  }
  if (damping != std::max(was.damping, 0.0)) {
    Child(element, "dynamics")->SetAttribute("damping", ExactText(damping));
  }
  if (friction != std::max(was.friction, 0.0)) {
    Child(element, "dynamics")->SetAttribute("friction", ExactText(friction));
  }
}

// The transmission of a joint, or a new one as Drake wants it.
TiXmlElement* TransmissionOf(const std::string& joint, TiXmlElement* robot) {
  for (TiXmlElement* e = robot->FirstChildElement("transmission"); e;
       e = e->NextSiblingElement("transmission")) {
    const TiXmlElement* moved = e->FirstChildElement("joint");
    const std::string* name =
        moved ? moved->Attribute(std::string("name")) : nullptr;
    if (name && *name == joint && e->FirstChildElement("actuator")) return e;
  }
  TiXmlElement* added = Append(robot, "transmission");
  added->SetAttribute("name", joint + "_transmission");
  Append(added, "type")
      ->LinkEndChild(
          new TiXmlText("transmission_interface/SimpleTransmission"));
  Append(added, "joint")->SetAttribute("name", joint);
  Append(added, "actuator")->SetAttribute("name", joint + "_motor");
  return added;
}

// The armature as Drake reads it, ratio^2 rotor_inertia.
void WriteRotors(const Model& model, TiXmlElement* robot) {
  const EffectSet& effects = model.effects();
  for (int i = 0; i < effects.size(); ++i) {
    const Effect& effect = effects.effect(i);
    const double armature = effect.kind() == "armature"
                                ? model.nominal().effects[effects.offset(i)]
                                : 0.0;
    if (armature <= 0.0 || model.mechanism().joints[effect.joint()].type ==
                               JointType::kSpherical) {
      continue;
    }
    robot->SetAttribute("xmlns:drake", "http://drake.mit.edu");
    TiXmlElement* actuator =
        TransmissionOf(effect.target(), robot)->FirstChildElement("actuator");
    TiXmlElement* ratio = Child(actuator, "drake:gear_ratio");
    const std::string* text = ratio->Attribute(std::string("value"));
    double n = 0.0;
    if (!text || !ReadNumber(*text, &n) || n == 0.0) {
      n = 1.0;
      ratio->SetAttribute("value", "1");
    }
    Child(actuator, "drake:rotor_inertia")
        ->SetAttribute("value", ExactText(armature / (n * n)));
  }
}

// What <dynamics> cannot say.
std::vector<std::string> EffectComments(const Model& model) {
  std::vector<std::string> all;
  if (model.nominal().gravity != 9.81) {
    all.push_back("gravity=" + ExactText(model.nominal().gravity) + " m/s^2");
  }
  for (int i = 0; i < model.effects().size(); ++i) {
    const Effect& effect = model.effects().effect(i);
    if (effect.kind() == "viscous_damping" ||
        effect.kind() == "coulomb_friction") {
      continue;
    }
    for (size_t k = 0; k < effect.parameters().size(); ++k) {
      const double value =
          model.nominal().effects[model.effects().offset(i) + k];
      all.push_back(effect.name() + " " + effect.parameters()[k].name + "=" +
                    ExactText(value) + " " + effect.parameters()[k].unit);
    }
  }
  return all;
}

// Puts comments first in the robot; ours of an earlier time go.
void WriteComments(const std::vector<std::string>& comments,
                   TiXmlElement* robot) {
  for (TiXmlNode* node = robot->FirstChild(); node;) {
    TiXmlNode* next = node->NextSibling();
    if (node->ToComment() &&
        node->ValueStr().rfind(" " + std::string(kOurs), 0) == 0) {
      robot->RemoveChild(node);
    }
    node = next;
  }
  TiXmlNode* first = robot->FirstChild();
  for (const std::string& text : comments) {
    TiXmlComment comment(Safe(kOurs + text).c_str());
    if (first) {
      robot->InsertBeforeChild(first, comment);
    } else {
      robot->InsertEndChild(comment);
    }
  }
}

}  // namespace

std::string WriteUrdf(const Model& model,
                      const std::vector<std::string>& comments,
                      UrdfContent content) {
  const Mechanism& mechanism = model.mechanism();
  TiXmlDocument document;
  UrdfOutline was;
  if (mechanism.source && content == UrdfContent::kWhole) {
    ParseRobot(*mechanism.source, mechanism.name, &document);
    was = ReadUrdfOutline(*mechanism.source, mechanism.name);
  } else {
    document.LinkEndChild(new TiXmlDeclaration("1.0", "", ""));
    Append(&document, "robot");
  }
  TiXmlElement* robot = document.FirstChildElement();
  if (was.robot_name != mechanism.name) {
    robot->SetAttribute("name", mechanism.name);
  }
  std::vector<std::string> all = comments;
  for (const std::string& effect : EffectComments(model)) all.push_back(effect);
  WriteComments(all, robot);
  const auto write_link = [&](int i) {
    const std::string& name = mechanism.links[i].name;
    WriteLink(model.nominal().links[i], FindPart(was.links, name),
              NamedElement(robot, "link", name));
  };
  write_link(0);
  for (size_t i = 0; i < mechanism.joints.size(); ++i) {
    const std::string& name = mechanism.joints[i].name;
    WriteJoint(model, static_cast<int>(i), FindPart(was.joints, name), content,
               NamedElement(robot, "joint", name));
    write_link(mechanism.joints[i].child_link);
  }
  WriteRotors(model, robot);
  TiXmlPrinter printer;
  printer.SetIndent("  ");
  document.Accept(&printer);
  return printer.Str();
}

}  // namespace sysid
