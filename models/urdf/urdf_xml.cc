#include "models/urdf/urdf_xml.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "models/error.h"
#include "models/urdf/xml_scan.h"

namespace sysid {
namespace {

const TiXmlAttribute* FindAttribute(const TiXmlElement* element,
                                    const char* name) {
  for (const TiXmlAttribute* a = element->FirstAttribute(); a; a = a->Next()) {
    if (std::strcmp(a->Name(), name) == 0) return a;
  }
  return nullptr;
}

std::string Place(const std::string& path, int row, int column) {
  return path + ":" + std::to_string(row) + ":" + std::to_string(column);
}

// "inf", "-inf" and the like.
bool ReadInfinity(const std::string& text, double* value) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  if (!std::isinf(number) || *end != '\0' ||
      text.find_first_of("iI") == std::string::npos) {
    return false;
  }
  *value = number;
  return true;
}

// How to go on with a model of another format, "" for unknown ones.
std::string HintFor(const std::string& root) {
  if (root == "mujoco") {
    return "this is MJCF, MuJoCo's format, which is not read: give the URDF "
           "that it was made from";
  }
  if (root == "sdf") {
    return "this is SDF, Gazebo's format, which is not read: give the URDF "
           "that it was made from";
  }
  return "";
}

}  // namespace

const TiXmlElement* ParseRobot(const std::string& text, const std::string& path,
                               TiXmlDocument* document) {
  constexpr char kHint[] = "a URDF is XML with <robot> as its root element";
  if (text.find_first_not_of(" \t\r\n") == std::string::npos) {
    throw InputError(path, "the file is empty", kHint);
  }
  CheckWellFormed(text, path);
  document->SetTabSize(1);
  document->Parse(text.c_str(), nullptr, TIXML_ENCODING_UTF8);
  if (document->Error()) {
    std::string what = document->ErrorDesc();
    if (!what.empty() && what.back() == '.') what.pop_back();
    const bool placed = document->ErrorRow() > 0;
    throw InputError(
        placed ? Place(path, document->ErrorRow(), document->ErrorCol()) : path,
        "not XML: " + what, "the fault is here or shortly before");
  }
  const TiXmlElement* robot = document->FirstChildElement();
  if (!robot) throw InputError(path, "no <robot> element", kHint);
  if (robot->ValueStr() != "robot") {
    throw InputError(
        Place(path, robot->Row(), robot->Column()),
        "no <robot> element: the root element is <" + robot->ValueStr() + ">",
        HintFor(robot->ValueStr()).empty() ? kHint
                                           : HintFor(robot->ValueStr()));
  }
  if (const TiXmlElement* second = robot->NextSiblingElement()) {
    throw InputError(Place(path, second->Row(), second->Column()),
                     "a second root element, <" + second->ValueStr() + ">",
                     "a file holds one robot");
  }
  return robot;
}

// Of anything in SI units: a mountain is as heavy. Products of a few of them
// are finite.
constexpr double kLargest = 1e12;

bool ReadNumber(const std::string& text, double* value) {
  const char* begin = text.data();
  const char* end = begin + text.size();
  // from_chars knows no leading plus sign.
  if (begin != end && *begin == '+' && begin + 1 != end && begin[1] != '-') {
    ++begin;
  }
  double number = 0;
  const auto [rest, error] = std::from_chars(begin, end, number);
  if (error != std::errc() || rest != end || !std::isfinite(number)) {
    return false;
  }
  *value = number;
  return true;
}

std::string ExactText(double value) {
  char text[32];
  const auto result =
      std::to_chars(text, text + sizeof(text), value == 0 ? 0.0 : value);
  return std::string(text, result.ptr);
}

std::string ExactText3(const double* values) {
  return ExactText(values[0]) + " " + ExactText(values[1]) + " " +
         ExactText(values[2]);
}

void UrdfElement::Fault(const std::string& text,
                        const std::string& hint) const {
  faults_->Add(element_->Row(), element_->Column(), what_ + ": " + text, hint);
}

void UrdfElement::FaultAt(const char* attribute, const std::string& text,
                          const std::string& hint) const {
  const TiXmlAttribute* found = FindAttribute(element_, attribute);
  if (!found) return Fault(text, hint);
  faults_->Add(found->Row(), found->Column(), what_ + ": " + text, hint);
}

UrdfElement UrdfElement::Child(const char* name) const {
  const TiXmlElement* child = element_->FirstChildElement(name);
  UrdfElement found(child, what_, faults_);
  if (child) {
    if (const TiXmlElement* second = child->NextSiblingElement(name)) {
      UrdfElement(second, what_, faults_)
          .Fault(std::string("a second <") + name + ">", "keep one");
    }
  }
  return found;
}

bool UrdfElement::Has(const char* attribute) const {
  return FindAttribute(element_, attribute) != nullptr;
}

std::string UrdfElement::Text(const char* attribute) const {
  const TiXmlAttribute* found = FindAttribute(element_, attribute);
  return found ? found->ValueStr() : "";
}

bool UrdfElement::Numbers(const char* attribute, int count,
                          double* values) const {
  if (!Has(attribute)) return false;
  const std::string text = Text(attribute);
  const std::string name =
      "<" + element_->ValueStr() + " " + attribute + "=\"" + text + "\">";
  std::istringstream words(text);
  std::vector<double> numbers;
  for (std::string word; words >> word;) {
    double number = 0;
    // Limits are written so where there are none.
    const bool is_limit = element_->ValueStr() == "limit";
    if (!ReadNumber(word, &number) &&
        !(is_limit && ReadInfinity(word, &number))) {
      FaultAt(attribute,
              "'" + word + "' in " + name + " is not a finite number",
              word.rfind("${", 0) == 0
                  ? "this is xacro: xacro file.xacro > file.urdf"
                  : "write it with digits and a point, such as -1.5e-3");
      return false;
    }
    if (std::abs(number) > kLargest && !is_limit) {
      FaultAt(attribute, "'" + word + "' in " + name + ": 1e12 is the most",
              "the units are m, rad, kg and s");
      return false;
    }
    numbers.push_back(number);
  }
  if (static_cast<int>(numbers.size()) != count) {
    FaultAt(attribute, name + " has " + std::to_string(numbers.size()) +
                           (numbers.size() == 1 ? " number" : " numbers") +
                           ", not " + std::to_string(count));
    return false;
  }
  std::copy(numbers.begin(), numbers.end(), values);
  return true;
}

bool UrdfElement::Number(const char* attribute, double* value) const {
  return Numbers(attribute, 1, value);
}

bool UrdfElement::Vector3(const char* attribute, double* values) const {
  return Numbers(attribute, 3, values);
}

bool UrdfElement::RequiredNumber(const char* attribute, double* value) const {
  if (!Has(attribute)) {
    Fault("<" + element_->ValueStr() + "> has no " + attribute);
    return false;
  }
  return Number(attribute, value);
}

bool UrdfElement::Origin(double* xyz, double* rpy) const {
  const UrdfElement origin = Child("origin");
  if (!origin.exists()) return true;
  origin.CheckAttributes({"xyz", "rpy"});
  if (origin.Has("quat_xyzw")) {
    origin.FaultAt("quat_xyzw", "<origin quat_xyzw> is not supported",
                   "give the rotation as rpy");
  }
  const bool xyz_read = !origin.Has("xyz") || origin.Vector3("xyz", xyz);
  const bool rpy_read = !origin.Has("rpy") || origin.Vector3("rpy", rpy);
  return xyz_read && rpy_read;
}

void UrdfElement::CheckChildren(const std::vector<std::string>& known) const {
  for (const TiXmlElement* child = element_->FirstChildElement(); child;
       child = child->NextSiblingElement()) {
    const std::string name = child->ValueStr();
    const UrdfElement here(child, what_, faults_);
    if (name.rfind("xacro:", 0) == 0) {
      here.Fault("<" + name + "> is xacro, not URDF",
                 "convert it first: xacro file.xacro > file.urdf");
      continue;
    }
    const std::string nearest = NearestName(name, known);
    if (!nearest.empty() && nearest != name) {
      here.Fault("unknown element <" + name + ">",
                 "did you mean <" + nearest + ">?");
    }
  }
}

void UrdfElement::CheckAttributes(const std::vector<std::string>& known) const {
  for (const TiXmlAttribute* a = element_->FirstAttribute(); a; a = a->Next()) {
    const std::string nearest = NearestName(a->Name(), known);
    if (!nearest.empty() && nearest != a->Name()) {
      FaultAt(a->Name(),
              "unknown attribute " + std::string(a->Name()) + " of <" +
                  element_->ValueStr() + ">",
              "did you mean " + nearest + "?");
    }
  }
}

}  // namespace sysid
