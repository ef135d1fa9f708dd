#include "models/error.h"

#include <algorithm>
#include <numeric>

#include "models/printable.h"

namespace sysid {
namespace {

std::string Format(const std::string& place, const std::string& what,
                   const std::string& hint) {
  std::string text = place.empty() ? what : place + ": " + what;
  if (!hint.empty()) text += "\n  hint: " + hint;
  return Printable(text);
}

// Levenshtein's distance.
int EditDistance(const std::string& a, const std::string& b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (size_t i = 1; i <= a.size(); ++i) {
    int diagonal = row[0];
    row[0] = static_cast<int>(i);
    for (size_t j = 1; j <= b.size(); ++j) {
      const int substitute = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substitute});
    }
  }
  return row.back();
}

}  // namespace

InputError::InputError(const std::string& place, const std::string& what,
                       const std::string& hint)
    : std::runtime_error(Format(place, what, hint)),
      place_(place),
      detail_(Printable(what)),
      hint_(hint) {}

std::string InputError::WithoutHint() const {
  return Format(place_, detail_, "");
}

std::string NearestName(const std::string& name,
                        const std::vector<std::string>& names) {
  std::string best;
  int best_distance = static_cast<int>(name.size()) / 3 + 1;
  for (const std::string& candidate : names) {
    const int distance = EditDistance(name, candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

std::string NameHint(const std::string& name,
                     const std::vector<std::string>& names) {
  const std::string nearest = NearestName(name, names);
  if (!nearest.empty()) return "did you mean '" + nearest + "'?";
  if (names.empty()) return "there is none to choose from";
  return "known: " + Join(names);
}

std::string Join(const std::vector<std::string>& parts,
                 const std::string& separator) {
  std::string text;
  for (const std::string& part : parts) {
    if (!text.empty()) text += separator;
    text += part;
  }
  return text;
}

}  // namespace sysid
