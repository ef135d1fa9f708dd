#include "models/urdf/urdf_xml.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <sstream>
#include <tuple>

#include "models/error.h"

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
  if (row <= 0) return path;
  return path + ":" + std::to_string(row) + ":" + std::to_string(column);
}

// Of anything in SI units: a mountain is as heavy. Products of a few of them
// are finite.
constexpr double kLargest = 1e12;

// A number as a whole: no rest ("1.0abc"), not inf, not nan; independent of the
// locale.
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

}  // namespace

void UrdfFaults::Add(int row, int column, const std::string& what,
                     const std::string& hint) {
  faults_.push_back({row, column, what, hint});
}

void UrdfFaults::Throw() const {
  if (faults_.empty()) return;
  if (faults_.size() == 1) {
    const Fault& fault = faults_[0];
    throw InputError(Place(path_, fault.row, fault.column), fault.what,
                     fault.hint);
  }
  std::vector<Fault> sorted = faults_;
  std::stable_sort(
      sorted.begin(), sorted.end(), [](const Fault& a, const Fault& b) {
        return std::tie(a.row, a.column) < std::tie(b.row, b.column);
      });
  std::string text = std::to_string(sorted.size()) + " faults";
  for (const Fault& fault : sorted) {
    text += "\n  " + Place(path_, fault.row, fault.column) + ": " + fault.what;
    if (!fault.hint.empty()) text += " (" + fault.hint + ")";
  }
  throw InputError(path_, text);
}

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
    throw InputError(Place(path, document->ErrorRow(), document->ErrorCol()),
                     "not XML: " + what, "the fault is here or shortly before");
  }
  const TiXmlElement* robot = document->FirstChildElement();
  if (!robot) throw InputError(path, "no <robot> element", kHint);
  if (robot->ValueStr() != "robot") {
    throw InputError(
        Place(path, robot->Row(), robot->Column()),
        "no <robot> element: the root element is <" + robot->ValueStr() + ">",
        kHint);
  }
  if (const TiXmlElement* second = robot->NextSiblingElement()) {
    throw InputError(Place(path, second->Row(), second->Column()),
                     "a second root element, <" + second->ValueStr() + ">",
                     "a file holds one robot");
  }
  return robot;
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
    if (!ReadNumber(word, &number)) {
      FaultAt(attribute,
              "'" + word + "' in " + name + " is not a finite number",
              word.rfind("${", 0) == 0
                  ? "this is xacro: xacro file.xacro > file.urdf"
                  : "write it with digits and a point, such as -1.5e-3");
      return false;
    }
    // Limits are written so where there are none.
    if (std::abs(number) > kLargest && element_->ValueStr() != "limit") {
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

bool UrdfElement::Vector3(const char* attribute,
                          Eigen::Vector3d* vector) const {
  return Numbers(attribute, 3, vector->data());
}

bool UrdfElement::RequiredNumber(const char* attribute, double* value) const {
  if (!Has(attribute)) {
    Fault("<" + element_->ValueStr() + "> has no " + attribute);
    return false;
  }
  return Number(attribute, value);
}

void UrdfElement::Origin(Eigen::Vector3d* p, Eigen::Matrix3d* R) const {
  const UrdfElement origin = Child("origin");
  if (!origin.exists()) return;
  origin.CheckAttributes({"xyz", "rpy"});
  if (origin.Has("quat_xyzw")) {
    origin.FaultAt("quat_xyzw", "<origin quat_xyzw> is not supported",
                   "give the rotation as rpy");
  }
  origin.Vector3("xyz", p);
  Eigen::Vector3d rpy = Eigen::Vector3d::Zero();
  origin.Vector3("rpy", &rpy);
  using Eigen::AngleAxisd;
  *R = (AngleAxisd(rpy[2], Eigen::Vector3d::UnitZ()).toRotationMatrix() *
        AngleAxisd(rpy[1], Eigen::Vector3d::UnitY()).toRotationMatrix()) *
       AngleAxisd(rpy[0], Eigen::Vector3d::UnitX()).toRotationMatrix();
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
