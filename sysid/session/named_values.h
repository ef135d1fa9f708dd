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

// The same of effects, "a@joint1,b@joint1,joint2,custom@joint1: min(q, 1);
// -qd": an effect on a pair of joints has a comma in its name, a typed law may
// have some within parentheses, and "custom@joint1: A; B" are two laws.
std::vector<std::string> SplitEffects(const std::string& text,
                                      const std::string& place);

// "name=1.5" -> {"name", 1.5}; "name" alone has no value. Throws InputError,
// also where a name comes twice.
std::vector<NamedValue> SplitAssignments(const std::string& text,
                                         const std::string& place);
// The same of SplitEffects.
std::vector<NamedValue> SplitEffectValues(const std::string& text,
                                          const std::string& place);

// The names of effects where they have no values: throws InputError for one.
std::vector<std::string> SplitEffectNames(const std::string& text,
                                          const std::string& place);

// The values with a place. Throws InputError there where a name comes twice.
std::vector<NamedValue> EachOnce(std::vector<NamedValue> values,
                                 const std::string& place);

}  // namespace sysid
