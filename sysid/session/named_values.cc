#include "sysid/session/named_values.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "models/error.h"
#include "sysid/io/csv.h"

namespace sysid {

namespace {

// Where the entry that begins at `from` ends: at a comma, with `nested` outside
// of parentheses, as long as those are closed.
size_t EntryEnd(const std::string& text, size_t from, bool nested) {
  int depth = 0;
  for (size_t i = from; i < text.size(); ++i) {
    if (nested && text[i] == '(') ++depth;
    if (nested && text[i] == ')') --depth;
    if (text[i] == ',' && depth <= 0) return i;
  }
  return depth > 0 ? std::min(text.find(',', from), text.size()) : text.size();
}

std::vector<std::string> Split(const std::string& text,
                               const std::string& place, bool nested) {
  std::vector<std::string> parts;
  if (Trim(text).empty()) return parts;
  size_t from = 0;
  while (true) {
    const size_t end = EntryEnd(text, from, nested);
    parts.emplace_back(Trim(std::string_view(text).substr(from, end - from)));
    if (parts.back().empty()) {
      throw InputError(place, "has an empty entry: '" + text + "'",
                       "separate entries by single commas");
    }
    if (end == text.size()) return parts;
    from = end + 1;
  }
}

// Whether an effect may go on behind a comma: "effect@joint1" of
// "effect@joint1,joint2", on a pair of joints. (Catalogue::Make knows which are
// of pairs.)
bool MayGoOn(const std::string& effect) {
  return effect.find('@') != std::string::npos &&
         effect.find_first_of(":,+*=") == std::string::npos;
}

// "custom@joint1: A; B" are two laws on one joint.
void AddLaws(const std::string& part, size_t colon,
             std::vector<std::string>* effects) {
  const std::string head = part.substr(0, colon + 1);
  const size_t before = effects->size();
  for (size_t from = colon + 1; from <= part.size();) {
    const size_t end = std::min(part.find(';', from), part.size());
    const std::string law(
        Trim(std::string_view(part).substr(from, end - from)));
    if (!law.empty()) effects->push_back(head + " " + law);
    from = end + 1;
  }
  // Catalogue::Make says that there is none.
  if (effects->size() == before) effects->push_back(head);
}

std::vector<NamedValue> ReadAssignments(const std::vector<std::string>& parts,
                                        const std::string& place) {
  std::vector<NamedValue> result;
  for (const std::string& part : parts) {
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
    result.push_back(value);
  }
  return EachOnce(std::move(result), place);
}

}  // namespace

std::vector<NamedValue> EachOnce(std::vector<NamedValue> values,
                                 const std::string& place) {
  std::set<std::string> names;
  for (NamedValue& value : values) {
    value.place = place;
    if (names.insert(value.name).second) continue;
    throw InputError(place, "'" + value.name + "' is named twice",
                     "name it once");
  }
  return values;
}

std::vector<std::string> SplitList(const std::string& text,
                                   const std::string& place) {
  return Split(text, place, false);
}

std::vector<std::string> SplitEffects(const std::string& text,
                                      const std::string& place) {
  std::vector<std::string> effects;
  for (const std::string& part : Split(text, place, true)) {
    const size_t at = part.find('@'), colon = part.find(':');
    if (at != std::string::npos && colon != std::string::npos && at < colon) {
      AddLaws(part, colon, &effects);
    } else if (at == std::string::npos && !effects.empty() &&
               MayGoOn(effects.back())) {
      effects.back() += "," + part;
    } else {
      effects.push_back(part);
    }
  }
  return effects;
}

std::vector<NamedValue> SplitAssignments(const std::string& text,
                                         const std::string& place) {
  return ReadAssignments(SplitList(text, place), place);
}

std::vector<NamedValue> SplitEffectValues(const std::string& text,
                                          const std::string& place) {
  return ReadAssignments(SplitEffects(text, place), place);
}

std::vector<std::string> SplitEffectNames(const std::string& text,
                                          const std::string& place) {
  std::vector<std::string> names;
  for (const NamedValue& effect : SplitEffectValues(text, place)) {
    if (effect.value) {
      throw InputError(place,
                       "'" + effect.name + "' has a value, which the fit finds",
                       "write " + place + " " + effect.name);
    }
    names.push_back(effect.name);
  }
  return names;
}

}  // namespace sysid
