#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <utility>
#include <vector>

#include "sysid/parameters/located.h"

namespace sysid {

// Takes YAML nodes for what they should be, or throws InputError with their
// file, line and column. `what` names the node in the text ("prior of x").
class YamlReader {
 public:
  using Entry = std::pair<YAML::Node, YAML::Node>;

  // `path` names the file in errors.
  explicit YamlReader(const std::string& path) : path_(path) {}

  const std::string& path() const { return path_; }

  // The root of the text's only document; null where there is none. Throws
  // InputError for text that is not YAML, and for a second document.
  YAML::Node Load(const std::string& text) const;

  std::string Place(const YAML::Mark& mark) const;
  std::string Place(const YAML::Node& node) const;
  [[noreturn]] void Fail(const YAML::Node& node, const std::string& what,
                         const std::string& hint = "") const;

  // The pairs of a map, in order. Throws for anything but a map, and for keys
  // that are no names or appear twice.
  std::vector<Entry> Map(const YAML::Node& node, const std::string& what,
                         const std::string& hint) const;
  // Throws for a key without a value (YAML would place the fault at whatever
  // follows).
  void CheckValue(const Entry& entry) const;
  // Throws for a key that is not known, with the nearest.
  void CheckKey(const YAML::Node& key, const std::string& of,
                const std::vector<std::string>& known) const;

  std::string Text(const YAML::Node& node, const std::string& what,
                   const std::string& hint = "") const;
  double Number(const YAML::Node& node, const std::string& what) const;
  Located<double> Positive(const YAML::Node& node,
                           const std::string& what) const;
  // One of the known words.
  Located<std::string> Word(const YAML::Node& node, const std::string& what,
                            const std::vector<std::string>& known) const;
  // The texts of a list, each once.
  std::vector<Located<std::string>> NameList(const YAML::Node& node,
                                             const std::string& what,
                                             const std::string& hint) const;

 private:
  static std::string KindOf(const YAML::Node& node);
  void CheckOneDocument(const std::string& text) const;

  std::string path_;
};

}  // namespace sysid
