#include "models/error.h"
#include "sysid/studio/studio_model.h"

namespace sysid {
namespace {

constexpr char kModelSchema[] = "sysid.studio.model/1";

Json StartJson(const StudioModel::Start& start) {
  return {{"values", start.values}, {"idle", start.without_influence}};
}

InputError Broken(const std::string& file) {
  return InputError(file,
                    "is broken: parts of a model are missing in it, or of "
                    "another kind",
                    "restore it, or save to another folder (--out)");
}

StudioModel::Start StartFrom(const Json& json) {
  StudioModel::Start start;
  json.at("values").get_to(start.values);
  json.at("idle").get_to(start.without_influence);
  return start;
}

}  // namespace

double StudioModel::Error(const char* key) const {
  const Json& value = page.at(key);
  return value.is_number() ? value.get<double>() : 0.0;
}

Json ToJson(const StudioModel& model) {
  Json candidates = Json::object();
  for (const auto& [name, start] : model.candidates) {
    candidates[name] = StartJson(start);
  }
  return {{"schema", kModelSchema},
          {"id", model.id},
          {"parent", model.parent},
          {"effects", model.effects},
          {"start", StartJson(model.start)},
          {"candidates", candidates},
          {"step", model.step},
          {"files", model.files},
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
    model.start = StartFrom(json.at("start"));
    for (const auto& [name, start] : json.at("candidates").items()) {
      model.candidates[name] = StartFrom(start);
    }
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

}  // namespace sysid
