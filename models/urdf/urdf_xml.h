#pragma once

#include <tinyxml.h>

#include <string>
#include <vector>

#include "models/math/types.h"

namespace sysid {

// The faults of one URDF file, gathered so that a user sees them all at once.
class UrdfFaults {
 public:
  // `path` is what messages call the file.
  explicit UrdfFaults(const std::string& path) : path_(path) {}

  // Row and column count from 1; a row of 0 is the file as a whole.
  void Add(int row, int column, const std::string& what,
           const std::string& hint = "");

  // Throws InputError where there are faults. One: with its place and hint.
  // Several: the file as the place, then one line per fault, in the order of
  // the file, each "file:line:column: what (hint)".
  void Throw() const;

 private:
  struct Fault {
    int row;
    int column;
    std::string what;
    std::string hint;
  };
  std::string path_;
  std::vector<Fault> faults_;
};

// Reading elements and attributes of a URDF with faults that name the place.
// What is absent leaves the output as it was.

// (xml_scan.cc) Checks that a text is well-formed XML as far as TinyXML does
// not: one root element with nothing but comments around it, every element
// closed by its own end tag, attributes quoted and in UTF-8, no control
// characters, neither as they are nor by their number (&#0;), nothing left
// open, no more than 100 elements inside each other (TinyXML would recurse into
// them). Throws InputError with line and column; `path` is what messages call
// the file.
void CheckWellFormed(const std::string& text, const std::string& path);

// Text to XML; throws InputError with line and column where it is not XML, or
// has no <robot> as its only root element.
const TiXmlElement* ParseRobot(const std::string& text, const std::string& path,
                               TiXmlDocument* document);

// One element and what it is called in messages ("link 'arm'").
class UrdfElement {
 public:
  UrdfElement(const TiXmlElement* element, const std::string& what,
              UrdfFaults* faults)
      : element_(element), what_(what), faults_(faults) {}

  bool exists() const { return element_ != nullptr; }
  const TiXmlElement* xml() const { return element_; }

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
  bool Vector3(const char* attribute, Eigen::Vector3d* vector) const;
  // As above; absence is a fault.
  bool RequiredNumber(const char* attribute, double* value) const;

  // <origin xyz rpy>: roll, pitch, yaw about fixed axes, rad.
  void Origin(Eigen::Vector3d* p, Eigen::Matrix3d* R) const;

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
