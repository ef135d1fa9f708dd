#pragma once

#include <optional>
#include <string>
#include <vector>

namespace sysid {

// The lists that flags hold.

// "a,b" -> {"a", "b"}; spaces around are dropped. Throws InputError at `place`
// for an empty entry.
std::vector<std::string> SplitList(const std::string& text,
                                   const std::string& place);

// "name=1.5" -> {"name", 1.5}; "name" alone has no value. Throws InputError,
// also where a name comes twice.
struct NamedValue {
  std::string name;
  std::optional<double> value;
  std::string place;
};
std::vector<NamedValue> SplitAssignments(const std::string& text,
                                         const std::string& place);

}  // namespace sysid
