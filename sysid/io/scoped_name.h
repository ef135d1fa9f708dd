#pragma once

#include <functional>
#include <string>

namespace sysid {

// A name on a flag that edits what is read. It may be meant for one run alone:
// "b.csv/joint1.q" is the joint1.q of b.csv.
struct ScopedName {
  std::string run;  // "" : every run; else a run's file, or its name alone
  std::string name;

  bool IsFor(const std::string& path) const;
};

// Splits at the first '/' behind which there is a name, unless the whole is
// one: names may have slashes too ("robot/joint1.q"). Where nothing is a name,
// at the last '/'.
ScopedName SplitScope(const std::string& text,
                      const std::function<bool(const std::string&)>& is_name);

}  // namespace sysid
