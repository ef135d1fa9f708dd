#include "sysid/studio/studio.h"

#include <algorithm>

#include "models/error.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/shooting_stage.h"
#include "sysid/report/page_data.h"
#include "sysid/session/named_values.h"

namespace sysid {
namespace {

Json Failed(const std::string& error, const std::string& hint) {
  return {{"type", "failed"}, {"error", error}, {"hint", hint}};
}

}  // namespace

Studio::Studio(StudioSetup setup)
    : setup_(std::move(setup)),
      header_(PageHeader(SourceOf(setup_))),
      folder_(setup_),
      models_(folder_.TakeModels()) {}

Studio::~Studio() { Close(); }

Studio::Model Studio::Admit(int id) const {
  const std::lock_guard lock(mutex_);
  if (running_) throw StudioBusy("a fit is running");
  const int count = static_cast<int>(models_.size());
  if (id < 0 || id >= count) {
    throw InputError("model", "there is no model " + std::to_string(id),
                     count == 0
                         ? "none is fitted yet"
                         : "the last is model " + std::to_string(count - 1));
  }
  return models_[id];
}

void Studio::Start() { Launch({}); }

void Studio::Add(int model, const std::string& effects) {
  Change({Admit(model), SplitEffects(effects, "effect"), ""});
}

void Studio::Remove(int model, const std::string& effect) {
  Change({Admit(model), {}, effect});
}

void Studio::Change(StudioChange change) {
  if (change.add.empty() && change.remove.empty()) {
    throw InputError("effect", "names none");
  }
  CheckChange(setup_, change);
  Launch(std::move(change));
}

void Studio::Launch(StudioChange change) {
  const std::lock_guard lock(mutex_);
  if (running_ || closed_) throw StudioBusy("a fit is running");
  if (change.from == nullptr && !models_.empty()) {
    throw InputError("model", "the model as given is fitted already",
                     "add effects to it");
  }
  const int id = static_cast<int>(models_.size());
  running_ = true;
  reported_s_ = 0.0;
  progress_ = {{"type", "progress"},
               {"title", change.Title()},
               {"doing", "starting"},
               {"iteration", 0},
               {"of", 0},
               {"error", nullptr},
               {"elapsed_s", 0.0}};
  ++reports_;
  changed_.notify_all();
  // The thread before has ended but for its last line: it needs no mutex.
  worker_ = std::jthread(
      [this, change = std::move(change), id](const std::stop_token& stop) {
        Work(stop, change, id);
      });
}

void Studio::Work(const std::stop_token& stop, const StudioChange& change,
                  int id) {
  const std::string title = change.Title();
  const double start_s = Now();
  Model model;
  Json end;
  try {
    model = std::make_shared<const StudioModel>(FitStudioModel(
        setup_, change, id, stop,
        [&](const Progress& progress) { Report(title, start_s, progress); }));
    folder_.Save(*model);
    end = {{"type", "done"}, {"model", id}};
  } catch (const Cancelled&) {
    end = {{"type", "cancelled"}};
  } catch (const InputError& error) {
    end = Failed(error.what(), error.hint());
  } catch (const std::exception& error) {
    end = Failed(error.what(), "");
  }
  const std::lock_guard lock(mutex_);
  if (end["type"] == "done") models_.push_back(std::move(model));
  running_ = false;
  ended_.push_back(std::move(end));
  changed_.notify_all();
}

void Studio::Report(const std::string& title, double start_s,
                    const Progress& progress) {
  constexpr double kPeriod = 0.05;  // s: more often nobody can read it
  const double now = Now();
  const std::lock_guard lock(mutex_);
  if (now - reported_s_ < kPeriod && progress_["doing"] == progress.doing) {
    return;
  }
  reported_s_ = now;
  progress_ = {{"type", "progress"},        {"title", title},
               {"doing", progress.doing},   {"iteration", progress.iteration},
               {"of", progress.of},         {"error", Finite(progress.error)},
               {"elapsed_s", now - start_s}};
  ++reports_;
  changed_.notify_all();
}

void Studio::Cancel() {
  const std::lock_guard lock(mutex_);
  worker_.request_stop();
}

void Studio::Close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    worker_.request_stop();
    changed_.notify_all();
  }
  // Nobody starts another any more.
  if (worker_.joinable()) worker_.join();
}

int Studio::models() const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(models_.size());
}

bool Studio::closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

std::string Studio::Page() const {
  std::vector<Model> models;
  {
    const std::lock_guard lock(mutex_);
    models = models_;
  }
  Json page = header_;
  for (const Model& model : models) {
    page["models"].push_back(model->page);
    if (!model->step.is_null()) page["steps"].push_back(model->step);
  }
  if (!models.empty()) {
    page["current"] = models.back()->id;
    if (models.back()->parent >= 0) page["compared"] = models.back()->parent;
  }
  return Compact(page);
}

std::optional<std::string> Studio::File(int model,
                                        const std::string& name) const {
  const std::lock_guard lock(mutex_);
  if (model < 0 || model >= static_cast<int>(models_.size())) {
    return std::nullopt;
  }
  const auto& files = models_[model]->files;
  const auto at = files.find(name);
  if (at == files.end()) return std::nullopt;
  return at->second;
}

std::vector<std::string> Studio::NextEvents(std::chrono::milliseconds patience,
                                            StudioCursor* cursor) const {
  std::vector<std::string> events;
  std::unique_lock lock(mutex_);
  if (!cursor->begun && !closed_) {
    *cursor = {true, ended_.size(), reports_};
    return {Compact(running_ ? progress_ : Json{{"type", "idle"}})};
  }
  changed_.wait_for(lock, patience, [&] {
    return closed_ || cursor->ended < ended_.size() ||
           (running_ && cursor->progress != reports_);
  });
  if (closed_) return events;
  for (; cursor->ended < ended_.size(); ++cursor->ended) {
    events.push_back(Compact(ended_[cursor->ended]));
  }
  if (running_ && cursor->progress != reports_) {
    events.push_back(Compact(progress_));
  }
  cursor->progress = reports_;
  return events;
}

}  // namespace sysid
