#include "sysid/exports/xml.h"

#include "models/urdf/urdf_xml.h"

namespace sysid {

TiXmlElement* AppendElement(TiXmlNode* parent, const std::string& name) {
  return parent->LinkEndChild(new TiXmlElement(name))->ToElement();
}

void SetText(TiXmlElement* element, const char* attribute,
             const std::string& text) {
  element->SetAttribute(attribute, text);
}

void SetNumber(TiXmlElement* element, const char* attribute, double value) {
  element->SetAttribute(attribute, ExactText(value));
}

std::string NumbersText(const Eigen::VectorXd& values) {
  std::string text;
  for (int i = 0; i < values.size(); ++i) {
    text += (i == 0 ? "" : " ") + ExactText(values[i]);
  }
  return text;
}

void SetNumbers(TiXmlElement* element, const char* attribute,
                const Eigen::VectorXd& values) {
  element->SetAttribute(attribute, NumbersText(values));
}

TiXmlElement* AppendText(TiXmlNode* parent, const std::string& name,
                         const std::string& text) {
  TiXmlElement* element = AppendElement(parent, name);
  element->LinkEndChild(new TiXmlText(text));
  return element;
}

void AppendComments(TiXmlNode* parent, const std::vector<std::string>& lines) {
  for (const std::string& line : lines) {
    std::string safe = " sysid: ";
    for (const char c : line) {
      if (c == '-' && safe.back() == '-') safe += ' ';
      safe += c;
    }
    parent->LinkEndChild(new TiXmlComment((safe + " ").c_str()));
  }
}

std::string Printed(const TiXmlDocument& document) {
  TiXmlPrinter printer;
  printer.SetIndent("  ");
  document.Accept(&printer);
  return printer.Str();
}

EffectValues::EffectValues(const Model& model) {
  const EffectSet& effects = model.effects();
  for (int i = 0; i < effects.size(); ++i) {
    const Effect& effect = effects.effect(i);
    if (effect.IsTyped() || effect.kind() == "force_table" ||
        effect.on_motor()) {
      continue;
    }
    for (size_t k = 0; k < effect.parameters().size(); ++k) {
      values_.emplace_back(effect.parameters()[k].name,
                           model.nominal().effects[effects.offset(i) + k]);
    }
  }
}

bool EffectValues::Has(const std::string& name) const {
  for (const auto& [known, value] : values_) {
    if (known == name) return true;
  }
  return false;
}

double EffectValues::operator()(const std::string& name) const {
  for (const auto& [known, value] : values_) {
    if (known == name) return value;
  }
  return 0.0;
}

}  // namespace sysid
