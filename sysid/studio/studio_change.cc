#include <algorithm>

#include "models/effects/catalogue.h"
#include "models/error.h"
#include "sysid/studio/studio_model.h"

namespace sysid {
namespace {

bool Contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

std::string StudioChange::Title() const {
  if (from == nullptr) return "as given";
  return remove.empty() ? "+ " + Join(add, " + ") : "- " + remove;
}

void CheckChange(const StudioSetup& setup, const StudioChange& change) {
  if (change.from == nullptr) return;
  const std::string place = "effect";
  const std::string model = "model " + std::to_string(change.from->id);
  if (!change.remove.empty() &&
      !Contains(change.from->effects, change.remove)) {
    throw InputError(place, "'" + change.remove + "' was not added to " + model,
                     change.from->effects.empty()
                         ? "it has no effects beyond the model as given"
                         : NameHint(change.remove, change.from->effects));
  }
  const Catalogue catalogue;
  for (size_t i = 0; i < change.add.size(); ++i) {
    const std::string& name = change.add[i];
    catalogue.Make(name, setup.session.model.mechanism(), place);  // or throws
    if (Contains(change.from->effects, name) ||
        std::count(change.add.begin(), change.add.end(), name) > 1) {
      throw InputError(place, "'" + name + "' is in " + model + " already",
                       "add another, or remove it");
    }
    if (change.from->candidates.count(name) == 0) {
      std::vector<std::string> names;
      for (const auto& [known, start] : change.from->candidates) {
        names.push_back(known);
      }
      throw InputError(
          place, "'" + name + "' is no candidate of " + model,
          names.empty() ? "it has none" : "its candidates: " + Join(names));
    }
  }
}

}  // namespace sysid
