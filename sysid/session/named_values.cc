#include "sysid/session/named_values.h"

#include <cmath>

#include "models/error.h"
#include "sysid/io/csv.h"

namespace sysid {

std::vector<std::string> SplitList(const std::string& text,
                                   const std::string& place) {
  std::vector<std::string> parts;
  if (Trim(text).empty()) return parts;
  size_t from = 0;
  while (true) {
    const size_t comma = text.find(',', from);
    const std::string part(Trim(std::string_view(text).substr(
        from, comma == std::string::npos ? comma : comma - from)));
    if (part.empty()) {
      throw InputError(place, "has an empty entry: '" + text + "'",
                       "separate entries by single commas");
    }
    parts.push_back(part);
    if (comma == std::string::npos) return parts;
    from = comma + 1;
  }
}

std::vector<NamedValue> SplitAssignments(const std::string& text,
                                         const std::string& place) {
  std::vector<NamedValue> result;
  for (const std::string& part : SplitList(text, place)) {
    const size_t equals = part.find('=');
    NamedValue value{std::string(Trim(part.substr(0, equals))), {}, place};
    if (equals != std::string::npos) {
      double number = 0.0;
      const std::string written = part.substr(equals + 1);
      if (!ParseNumber(Trim(written), &number) || !std::isfinite(number)) {
        throw InputError(place,
                         "'" + written + "' is not a number, in '" + part + "'",
                         "write name=number, in SI units");
      }
      value.value = number;
    }
    for (const NamedValue& known : result) {
      if (known.name == value.name) {
        throw InputError(place, "'" + value.name + "' is named twice",
                         "name it once");
      }
    }
    result.push_back(value);
  }
  return result;
}

}  // namespace sysid
