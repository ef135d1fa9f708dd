#include "models/error.h"
#include "sysid/studio/studio_model.h"

namespace sysid {
namespace {

constexpr char kModelSchema[] = "sysid.studio.model/1";

Json StartJson(const StudioModel::Start& start) {
  return {{"values", start.values}, {"idle", start.idle}};
}

StudioModel::Start StartFrom(const Json& json) {
  StudioModel::Start start;
  json.at("values").get_to(start.values);
  json.at("idle").get_to(start.idle);
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
    json.at("id").get_to(model.id);
    json.at("parent").get_to(model.parent);
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
    throw InputError(file,
                     "is broken: parts of a model are missing in it, or of "
                     "another kind",
                     "restore it, or save to another folder (--out)");
  }
}

}  // namespace sysid
