#pragma once

#include <string>
#include <vector>

#include "sysid/parameters/fit_specification.h"

namespace sysid {

// The lists that flags hold.

// "a,b" -> {"a", "b"}; spaces around are dropped. Throws InputError at `place`
// for an empty entry.
std::vector<std::string> SplitList(const std::string& text,
                                   const std::string& place);

// "name=1.5" -> {"name", 1.5}; "name" alone has no value. Throws InputError,
// also where a name comes twice.
std::vector<NamedValue> SplitAssignments(const std::string& text,
                                         const std::string& place);

}  // namespace sysid
