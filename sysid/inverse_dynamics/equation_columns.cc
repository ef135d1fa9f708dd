#include "sysid/inverse_dynamics/equation_columns.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "models/effects/catalogue.h"
#include "models/error.h"

namespace sysid {
namespace {

// The parameters of an effect in which its law is linear from where it is off;
// none where others must be searched before anything shows. A drive shows
// without its delay, a pair of joints with the first of two signs.
std::vector<std::string> LinearNames(const Effect& effect) {
  if (!effect.states().empty()) return {};
  const bool shows = (effect.hooks() & (kDriveHook | kPairHook)) != 0;
  std::vector<std::string> names;
  for (const EffectParameter& p : effect.parameters()) {
    if (p.grid.empty() && !p.whole) {
      names.push_back(p.name);
    } else if (!shows) {
      return {};
    }
  }
  names.insert(names.end(), effect.adjusts_nominal().begin(),
               effect.adjusts_nominal().end());
  return names;
}

}  // namespace

EquationColumns MakeEquationColumns(
    const Model& start, const std::vector<FreeParameter>& free,
    const std::vector<std::shared_ptr<const Effect>>& effects,
    const std::set<std::string>& known) {
  EquationColumns columns(start);
  std::vector<std::string> names;
  for (const FreeParameter& one : free) names.push_back(one.parameter.name);
  columns.free = static_cast<int>(names.size());
  std::set<std::string> taken(names.begin(), names.end());
  taken.insert(known.begin(), known.end());
  // Of laws that share parameters the commoner one, whatever the order.
  const std::vector<std::string> kinds = Catalogue().kinds();
  const auto place = [&](const Effect& effect) {
    return std::pair(std::find(kinds.begin(), kinds.end(), effect.kind()),
                     effect.name());
  };
  std::vector<std::shared_ptr<const Effect>> ordered = effects;
  std::sort(ordered.begin(), ordered.end(), [&](const auto& a, const auto& b) {
    return place(*a) < place(*b);
  });
  for (const auto& effect : ordered) {
    const std::vector<std::string> own = LinearNames(*effect);
    if (own.empty() ||
        std::any_of(own.begin(), own.end(), [&](const std::string& name) {
          return taken.contains(name);
        })) {
      continue;
    }
    try {
      columns.model.AddEffect(effect);
    } catch (const InputError&) {
      continue;  // another law of the same parameters is there
    }
    taken.insert(own.begin(), own.end());
    columns.candidates.push_back({effect, static_cast<int>(names.size()),
                                  static_cast<int>(own.size()),
                                  (effect->hooks() & kReadsEffort) != 0});
    names.insert(names.end(), own.begin(), own.end());
  }
  columns.parameters = FindParameters(columns.model, names, "effects");
  return columns;
}

}  // namespace sysid
