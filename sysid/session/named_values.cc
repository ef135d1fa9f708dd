#include "sysid/session/named_values.h"

#include <algorithm>
#include <cmath>

#include "models/error.h"
#include "sysid/io/csv.h"

namespace sysid {

namespace {

// Where the entry that begins at `from` ends: at a comma outside of
// parentheses, as long as those are closed.
size_t EntryEnd(const std::string& text, size_t from) {
  int depth = 0;
  for (size_t i = from; i < text.size(); ++i) {
    if (text[i] == '(') ++depth;
    if (text[i] == ')') --depth;
    if (text[i] == ',' && depth <= 0) return i;
  }
  return depth > 0 ? std::min(text.find(',', from), text.size()) : text.size();
}

// "custom@joint1: A; B" are two laws on one joint.
void AddEntry(const std::string& part, std::vector<std::string>* parts) {
  // An effect on a pair of joints, which are written with a comma or a plus.
  if (!parts->empty() && part.find('@') == std::string::npos &&
      parts->back().starts_with("gear_coupling@") &&
      parts->back().find_first_of(",+*") == std::string::npos) {
    parts->back() += "," + part;
    return;
  }
  const size_t at = part.find('@'), colon = part.find(':');
  if (at == std::string::npos || colon == std::string::npos || colon < at) {
    parts->push_back(part);
    return;
  }
  const std::string head = part.substr(0, colon + 1);
  for (size_t from = colon + 1; from <= part.size();) {
    const size_t end = std::min(part.find(';', from), part.size());
    const std::string law(
        Trim(std::string_view(part).substr(from, end - from)));
    if (!law.empty()) parts->push_back(head + " " + law);
    from = end + 1;
  }
}

}  // namespace

std::vector<std::string> SplitList(const std::string& text,
                                   const std::string& place) {
  std::vector<std::string> parts;
  if (Trim(text).empty()) return parts;
  size_t from = 0;
  while (true) {
    const size_t end = EntryEnd(text, from);
    const std::string part(
        Trim(std::string_view(text).substr(from, end - from)));
    if (part.empty()) {
      throw InputError(place, "has an empty entry: '" + text + "'",
                       "separate entries by single commas");
    }
    AddEntry(part, &parts);
    if (end == text.size()) return parts;
    from = end + 1;
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
