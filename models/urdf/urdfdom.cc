#include "models/urdf/urdfdom.h"

#include <console_bridge/console.h>
#include <tinyxml.h>
#include <urdf_parser/urdf_parser.h>

#include <cmath>
#include <mutex>

#include "models/error.h"
#include "models/urdf/urdf_xml.h"

namespace sysid {
namespace {

TiXmlElement* AddElement(TiXmlNode* parent, const std::string& name) {
  return parent->LinkEndChild(new TiXmlElement(name))->ToElement();
}

void AddOrigin(TiXmlNode* parent, const double* xyz, const double* rpy) {
  TiXmlElement* origin = AddElement(parent, "origin");
  origin->SetAttribute("xyz", ExactText3(xyz));
  origin->SetAttribute("rpy", ExactText3(rpy));
}

void AddLink(const UrdfLink& link, TiXmlNode* robot) {
  TiXmlElement* element = AddElement(robot, "link");
  element->SetAttribute("name", link.name);
  if (!link.has_inertial) return;
  TiXmlElement* inertial = AddElement(element, "inertial");
  AddOrigin(inertial, link.xyz, link.rpy);
  AddElement(inertial, "mass")->SetAttribute("value", ExactText(link.mass));
  TiXmlElement* inertia = AddElement(inertial, "inertia");
  static constexpr const char* kMoments[] = {"ixx", "ixy", "ixz",
                                             "iyy", "iyz", "izz"};
  for (int i = 0; i < 6; ++i) {
    inertia->SetAttribute(kMoments[i], ExactText(link.inertia[i]));
  }
}

void AddJoint(const UrdfJoint& joint, const UrdfOutline& outline,
              TiXmlNode* robot) {
  const bool spherical = joint.type == JointType::kSpherical;
  TiXmlElement* element = AddElement(robot, "joint");
  element->SetAttribute("name", joint.name);
  element->SetAttribute("type", spherical ? "floating" : ToString(joint.type));
  AddOrigin(element, joint.xyz, joint.rpy);
  AddElement(element, "parent")
      ->SetAttribute("link", outline.links[joint.parent].name);
  AddElement(element, "child")
      ->SetAttribute("link", outline.links[joint.child].name);
  AddElement(element, "axis")->SetAttribute("xyz", ExactText3(joint.axis));
  TiXmlElement* limit = AddElement(element, "limit");
  limit->SetAttribute("lower", ExactText(joint.lower));
  limit->SetAttribute("upper", ExactText(joint.upper));
  // What the file leaves out is infinite, which urdfdom cannot read.
  limit->SetAttribute(
      "effort", ExactText(std::isfinite(joint.effort) ? joint.effort : 0));
  limit->SetAttribute(
      "velocity",
      ExactText(std::isfinite(joint.velocity) ? joint.velocity : 0));
  TiXmlElement* dynamics = AddElement(element, "dynamics");
  dynamics->SetAttribute("damping", ExactText(joint.damping));
  dynamics->SetAttribute("friction", ExactText(joint.friction));
}

// Takes what urdfdom would print; the handler is the process's.
class ConsoleCapture : public console_bridge::OutputHandler {
 public:
  ConsoleCapture() : previous_(console_bridge::getOutputHandler()) {
    console_bridge::useOutputHandler(this);
  }
  ~ConsoleCapture() override { console_bridge::useOutputHandler(previous_); }

  void log(const std::string& text, console_bridge::LogLevel level, const char*,
           int) override {
    if (level < console_bridge::CONSOLE_BRIDGE_LOG_ERROR) return;
    if (!text_.empty()) text_ += "; ";
    text_ += text;
  }
  const std::string& text() const { return text_; }

 private:
  console_bridge::OutputHandler* previous_;
  std::string text_;
};

}  // namespace

std::string TextForUrdfdom(const UrdfOutline& outline) {
  TiXmlDocument document;
  TiXmlElement* robot = AddElement(&document, "robot");
  robot->SetAttribute("name", outline.robot_name);
  for (const UrdfLink& link : outline.links) AddLink(link, robot);
  for (const UrdfJoint& joint : outline.joints) {
    AddJoint(joint, outline, robot);
  }
  TiXmlPrinter printer;
  document.Accept(&printer);
  return printer.Str();
}

urdf::ModelInterfaceSharedPtr ParseWithUrdfdom(const std::string& text,
                                               const std::string& path) {
  static std::mutex console_mutex;
  const std::lock_guard<std::mutex> lock(console_mutex);
  ConsoleCapture console;
  urdf::ModelInterfaceSharedPtr model;
  std::string reason;
  try {
    model = urdf::parseURDF(text);
  } catch (const std::exception& error) {
    reason = error.what();
  }
  if (model) return model;
  if (reason.empty()) reason = console.text();
  throw InputError(path, "urdfdom refuses the file: " + reason);
}

}  // namespace sysid
