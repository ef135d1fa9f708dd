#pragma once

#include <tinyxml.h>

#include <string>
#include <vector>

#include "models/urdf/urdf_faults.h"

namespace sysid {

// Reading elements and attributes of a URDF with faults that name the place.
// What is absent leaves the output as it was.

// Text to XML; throws InputError with line and column where it is not XML, or
// has no <robot> as its only root element.
const TiXmlElement* ParseRobot(const std::string& text, const std::string& path,
                               TiXmlDocument* document);

// A number as a whole: no rest ("1.0abc"), not inf, not nan; independent of the
// locale.
bool ReadNumber(const std::string& text, double* value);

// The shortest text that reads back as the same number ("0" for -0), and three
// of them, separated by spaces.
std::string ExactText(double value);
std::string ExactText3(const double* values);

// One element and what it is called in messages ("link 'arm'").
class UrdfElement {
 public:
  UrdfElement(const TiXmlElement* element, const std::string& what,
              UrdfFaults* faults)
      : element_(element), what_(what), faults_(faults) {}

  bool exists() const { return element_ != nullptr; }
  const TiXmlElement* xml() const { return element_; }
  const std::string& what() const { return what_; }

  // A fault at this element (at its attribute): "<what>: <text>".
  void Fault(const std::string& text, const std::string& hint = "") const;
  void FaultAt(const char* attribute, const std::string& text,
               const std::string& hint = "") const;

  // The only child of this name; a second one is a fault. May not exist.
  UrdfElement Child(const char* name) const;
  bool Has(const char* attribute) const;
  std::string Text(const char* attribute) const;  // "" where absent

  // Numbers of an attribute, separated by white space. False where it is absent
  // or at fault (which is noted).
  bool Number(const char* attribute, double* value) const;
  bool Vector3(const char* attribute, double* values) const;
  // As above; absence is a fault.
  bool RequiredNumber(const char* attribute, double* value) const;

  // <origin xyz rpy>.
  bool Origin(double* xyz, double* rpy) const;

  // A child element or an attribute that is not known but whose name is nearly
  // one of the known is a slip of the fingers, which would be ignored silently:
  // a fault. Others are extensions and are ignored.
  void CheckChildren(const std::vector<std::string>& known) const;
  void CheckAttributes(const std::vector<std::string>& known) const;

 private:
  bool Numbers(const char* attribute, int count, double* values) const;

  const TiXmlElement* element_;
  std::string what_;
  UrdfFaults* faults_;
};

}  // namespace sysid
