#include "sysid/studio/studio_model.h"

#include <algorithm>

#include "models/effects/catalogue.h"
#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/session/effect_inputs.h"
#include "sysid/session/law_values.h"

namespace sysid {
namespace {

constexpr char kModelSchema[] = "sysid.studio.model/1";

InputError Broken(const std::string& file) {
  return InputError(file,
                    "is broken: parts of a model are missing in it, or of "
                    "another kind",
                    "restore it, or save to another folder (--out)");
}

}  // namespace

static void to_json(Json& json, const StudioModel::Start& start) {
  json = {{"values", start.values}, {"idle", start.without_influence}};
}

static void from_json(const Json& json, StudioModel::Start& start) {
  json.at("values").get_to(start.values);
  json.at("idle").get_to(start.without_influence);
}

double StudioModel::Error(const char* key) const {
  const Json& value = page.at(key);
  return value.is_number() ? value.get<double>() : 0.0;
}

Json ToJson(const StudioModel& model) {
  return {{"schema", kModelSchema}, {"id", model.id},
          {"parent", model.parent}, {"effects", model.effects},
          {"start", model.start},   {"candidates", model.candidates},
          {"step", model.step},     {"files", model.files},
          {"page", model.page}};
}

StudioModel StudioModelFrom(const Json& json, const std::string& file) {
  try {
    StudioModel model;
    if (json.at("schema") != kModelSchema) {
      throw InputError(file, "is of another version",
                       "save to another folder (--out)");
    }
    // get<int>() rounds, wraps, and takes `true` for 1.
    const auto whole = [&](const char* key) {
      const Json& value = json.at(key);
      if (!value.is_number_integer() || value != value.get<int>()) {
        throw Broken(file);
      }
      return value.get<int>();
    };
    model.id = whole("id");
    model.parent = whole("parent");
    json.at("effects").get_to(model.effects);
    json.at("start").get_to(model.start);
    json.at("candidates").get_to(model.candidates);
    model.step = json.at("step");
    json.at("files").get_to(model.files);
    model.page = json.at("page");
    model.page.at("candidates");
    model.Error("trainError");
    model.Error("holdoutError");
    return model;
  } catch (const Json::exception&) {
    throw Broken(file);
  }
}

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
    const auto effect =
        catalogue.Make(name, setup.session.model.mechanism(), place);
    if (Contains(change.from->effects, effect->name()) ||
        std::count(change.add.begin(), change.add.end(), name) > 1) {
      throw InputError(place, "'" + name + "' is in " + model + " already",
                       "add another, or remove it");
    }
    const std::vector<const Run*> runs = AllRunsOf(setup.session);
    CheckCanRead(*effect, runs, place);
    CheckHasValues(*effect, setup.session.model.mechanism(), runs, place);
  }
}

}  // namespace sysid
