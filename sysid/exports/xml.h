#pragma once

#include <tinyxml.h>

#include <Eigen/Core>
#include <string>
#include <vector>

#include "models/model.h"

namespace sysid {

// Elements of the files that exports write.

TiXmlElement* AppendElement(TiXmlNode* parent, const std::string& name);
void SetText(TiXmlElement* element, const char* attribute,
             const std::string& text);
// The shortest text that reads back as the same number; of several, with
// spaces between.
void SetNumber(TiXmlElement* element, const char* attribute, double value);
std::string NumbersText(const Eigen::VectorXd& values);
void SetNumbers(TiXmlElement* element, const char* attribute,
                const Eigen::VectorXd& values);
// <name>text</name>
TiXmlElement* AppendText(TiXmlNode* parent, const std::string& name,
                         const std::string& text);

// Comments at the end of `parent`, each behind "sysid: ". XML allows no "--".
void AppendComments(TiXmlNode* parent, const std::vector<std::string>& lines);

std::string Printed(const TiXmlDocument& document);

// The values of the effects' parameters by name. Of laws that a user typed and
// of tables there are none: their names say nothing about other effects.
class EffectValues {
 public:
  explicit EffectValues(const Model& model);
  // Zero of what the model lacks.
  double operator()(const std::string& name) const;
  bool Has(const std::string& name) const;

 private:
  std::vector<std::pair<std::string, double>> values_;
};

}  // namespace sysid
