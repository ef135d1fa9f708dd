#include "sysid/studio/studio_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

#include "models/error.h"
#include "sysid/io/byte_source.h"
#include "sysid/io/cell.h"
#include "sysid/io/write_file.h"
#include "sysid/report/json.h"

namespace sysid {
namespace {

constexpr char kIndex[] = "studio.json";
constexpr char kSchema[] = "sysid.studio/1";

// FNV-1a: tells files apart that a user may mistake, not those of an attacker.
class Digest {
 public:
  void Add(const void* data, size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (size_t i = 0; i < size; ++i) {
      hash_ = (hash_ ^ bytes[i]) * 1099511628211ull;
    }
  }
  void Add(const std::string& text) { Add(text.data(), text.size()); }
  void Add(const RowMatrixXd& m) {
    Add(m.data(), sizeof(double) * static_cast<size_t>(m.size()));
  }
  std::string Text() const {
    return Format("%016llx", static_cast<unsigned long long>(hash_));
  }

 private:
  std::uint64_t hash_ = 14695981039346656037ull;
};

Json ToJson(const std::vector<Run>& runs) {
  return List(runs, [](const Run& run) -> Json {
    Digest digest;
    digest.Add(run.t.data(), sizeof(double) * run.t.size());
    digest.Add(run.effort);
    for (const Input& input : run.inputs) {
      digest.Add(input.name);
      digest.Add(input.values.data(), sizeof(double) * input.values.size());
    }
    for (const auto& channel : run.channels) {
      digest.Add(channel.name);
      digest.Add(channel.values);
    }
    return {
        {"name", run.name}, {"samples", run.size()}, {"digest", digest.Text()}};
  });
}

// What must be the same for saved models to be models of a session.
Json Describe(const StudioSetup& setup) {
  const Session& session = setup.session;
  Digest model;
  model.Add(ReadTextFile(session.model_file));
  const auto start = [](const FreeParameter& f) -> Json {
    return {
        {"name", f.parameter.name},
        {"initial", Finite(f.initial)},
        {"lower", Finite(f.lower)},
        {"upper", Finite(f.upper)},
        {"prior", f.prior ? Json{f.prior->mean, f.prior->std} : Json(nullptr)}};
  };
  // The values that --fix and a specification set.
  const auto nominal = [](const Parameter& p) { return Finite(p.nominal); };
  const EstimationOptions& options = session.options;
  const Json described = {
      {"model", {{"name", session.model_name}, {"digest", model.Text()}}},
      {"runs", ToJson(session.runs)},
      {"holdout", ToJson(session.holdout)},
      {"free", List(session.free, start)},
      {"effects", session.effects},
      {"values", List(AllParameters(session.model), nominal)},
      {"fixed", session.fixed},
      {"candidates",
       List(setup.candidates, [](const auto& e) { return e->name(); })},
      {"options",
       {{"step", options.rollout.step},
        {"integrator", static_cast<int>(options.rollout.integrator)},
        {"integrator_may_change", options.rollout.may_change},
        {"segment", options.segment},
        {"noise", options.noise},
        {"residual", static_cast<int>(options.orientation)},
        {"loss", static_cast<int>(options.loss)},
        {"seed", setup.seed}}}};
  // As it is read back.
  return Json::parse(Dump(described));
}

// The runs of the same names of which the numbers are others; empty where the
// lists do not name the same.
std::vector<std::string> ChangedIn(const Json& saved, const Json& now) {
  std::vector<std::string> changed;
  if (saved.size() != now.size()) return changed;
  for (size_t i = 0; i < now.size(); ++i) {
    if (saved[i].at("name") != now[i].at("name")) return {};
    if (saved[i] != now[i]) changed.push_back(now[i].at("name"));
  }
  return changed;
}

std::string NamesIn(const Json& runs) {
  std::vector<std::string> names;
  for (const Json& run : runs) names.push_back(run.at("name"));
  return names.empty() ? "none" : Join(names);
}

[[noreturn]] void FailBroken(const std::string& file, const std::string& why) {
  throw InputError(file, "is broken: " + why,
                   "restore it, or save to another folder (--out)");
}

Json ReadJson(const std::string& file) {
  std::optional<Json> json = ParseJson(ReadTextFile(file));
  if (!json) FailBroken(file, "it is no JSON, or nested too deep");
  return *std::move(json);
}

}  // namespace

FolderLock::FolderLock(const std::string& folder)
    : descriptor_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  // A file system that knows no locks has none to refuse.
  if (descriptor_ < 0 || flock(descriptor_, LOCK_EX | LOCK_NB) == 0 ||
      errno != EWOULDBLOCK) {
    return;
  }
  close(descriptor_);
  throw InputError(folder, "another sysid_studio saves its session there",
                   "end that one first, or save to another folder (--out)");
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

StudioFolder::StudioFolder(const StudioSetup& setup) : folder_(setup.folder) {
  if (folder_.empty()) return;
  session_ = Describe(setup);
  if (!std::filesystem::exists(folder_)) CheckWritableFolder(folder_, "--out");
  lock_.emplace(folder_);
  if (std::filesystem::exists(File(kIndex))) {
    Read();
    CheckWritableFolder(folder_, "--out");
    return;
  }
  if (std::filesystem::exists(File(NameOf(0)))) {
    throw InputError(File(NameOf(0)),
                     std::string("would be replaced: the folder has no ") +
                         kIndex + " that says of what session it is",
                     "restore that, or save to another folder (--out)");
  }
  CheckWritableFolder(folder_, "--out");
  WriteIndex(0);
}

std::string StudioFolder::File(const std::string& name) const {
  return (std::filesystem::path(folder_) / name).string();
}

std::string StudioFolder::NameOf(int id) const {
  return "model-" + std::to_string(id) + ".json";
}

void StudioFolder::Read() {
  const Json index = ReadJson(File(kIndex));
  try {
    if (index.at("schema") != kSchema) {
      throw InputError(File(kIndex),
                       "is of another version: " + index.at("schema").dump() +
                           " and not \"" + kSchema + "\"",
                       "save to another folder (--out)");
    }
    CheckSame(index.at("session"));
    const auto names = index.at("models").get<std::vector<std::string>>();
    for (size_t i = 0; i < names.size(); ++i) {
      if (names[i] != NameOf(static_cast<int>(i))) {
        FailBroken(File(kIndex), "'" + names[i] + "' is no name of a model");
      }
      const std::string file = File(names[i]);
      auto model =
          std::make_shared<StudioModel>(StudioModelFrom(ReadJson(file), file));
      if (model->id != static_cast<int>(i) || model->parent >= model->id) {
        FailBroken(file, "it is another model's");
      }
      models_.push_back(std::move(model));
    }
  } catch (const Json::exception&) {
    FailBroken(File(kIndex),
               "parts of a session are missing in it, or of another kind");
  }
}

void StudioFolder::CheckSame(const Json& saved) const {
  const std::string hint =
      "save to another folder (--out), or open this one as it was begun";
  if (saved.at("model") != session_.at("model")) {
    throw InputError(File(kIndex),
                     "is a session of another model: " +
                         saved.at("model").at("name").get<std::string>() +
                         " (its URDF, as it was then)",
                     hint);
  }
  for (const char* kind : {"runs", "holdout"}) {
    if (saved.at(kind) == session_.at(kind)) continue;
    const std::vector<std::string> changed =
        ChangedIn(saved.at(kind), session_.at(kind));
    if (!changed.empty()) {
      throw InputError(
          File(kIndex),
          "was begun with other numbers in " + Join(changed) +
              (changed.size() > 1 ? ", which have" : ", which has") +
              " changed since",
          hint);
    }
    throw InputError(File(kIndex),
                     std::string("is a session of other ") +
                         (std::string(kind) == "runs" ? "" : "held-out ") +
                         "runs: " + NamesIn(saved.at(kind)) +
                         " (as they were then)",
                     hint);
  }
  for (const auto& [key, value] : session_.at("options").items()) {
    if (saved.at("options").at(key) == value) continue;
    throw InputError(File(kIndex), "was begun with another --" + key, hint);
  }
  for (const auto& [key, value] : session_.items()) {
    if (saved.at(key) == value) continue;
    throw InputError(File(kIndex), "was begun with other " + key, hint);
  }
}

void StudioFolder::WriteIndex(int models) const {
  Json names = Json::array();
  for (int id = 0; id < models; ++id) names.push_back(NameOf(id));
  WriteFileAtomically(
      File(kIndex),
      Dump({{"schema", kSchema}, {"session", session_}, {"models", names}}));
}

void StudioFolder::Save(const StudioModel& model) {
  if (folder_.empty()) return;
  WriteFileAtomically(File(NameOf(model.id)), Dump(ToJson(model)));
  WriteIndex(model.id + 1);
}

}  // namespace sysid
