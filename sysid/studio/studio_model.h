#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "sysid/diagnosis/evaluated_model.h"
#include "sysid/report/json.h"
#include "sysid/report/page_data.h"
#include "sysid/session/session.h"

namespace sysid {

// What a live session starts from.
struct StudioSetup {
  Session session;           // as opened: the model as given
  DiagnosisProblem problem;  // of OpenDiagnosis
  std::vector<std::shared_ptr<const Effect>> candidates;
  PageSource page;         // its commands
  std::string folder;      // where it is saved; empty: nowhere
  std::uint64_t seed = 1;  // of the session: one of another is another

  explicit StudioSetup(const Session& s) : session(s), problem(s.model) {}
};

// A model of the session, once it is fitted: all that the page shows of it, and
// where the fit of a model that comes of it starts. Plain values, the same
// whether it was fitted just now or read from the folder.
struct StudioModel {
  // How a candidate that is added starts.
  struct Start {
    std::map<std::string, double> values;  // by parameter
    std::set<std::string>
        without_influence;  // parameters that the data says nothing of
  };

  int id = 0;
  int parent = -1;                   // -1: the model as given
  std::vector<std::string> effects;  // beyond the model as given
  Start start;                       // of these, and of what else is free
  std::map<std::string, Start> candidates;   // by effect
  Json page;                                 // ModelData of page_data.ts
  Json step;                                 // StepData; null as given
  std::map<std::string, std::string> files;  // text by name

  double Error(const char* key) const;  // of the page: 0 where there is none
};

// What is to be made of which model.
struct StudioChange {
  std::shared_ptr<const StudioModel> from;  // null: the model as given
  std::vector<std::string> add;
  std::string remove;

  // "+ coulomb_friction@joint1", as StepData has it; "as given".
  std::string Title() const;
};

// Throws InputError where the change cannot be made: an effect that is unknown,
// there already, not there to be removed, or reads what a run does not have.
void CheckChange(const StudioSetup& setup, const StudioChange& change);

// What all models of the session share, for its page. Points at both.
PageSource SourceOf(const StudioSetup& setup);

// The changed model, fitted, diagnosed, and fitted once more to whole runs for
// its files. Added effects start at what their refit found, or else at what the
// screening expects, which is made anew for what was no candidate. Throws
// InputError where that expects nothing of it, Cancelled where `stop` asks for
// it. `noise` is that of the training runs.
StudioModel FitStudioModel(
    const StudioSetup& setup, const StudioChange& change, int id,
    const std::stop_token& stop,
    const std::function<void(const Progress&)>& progress);

// As it is saved; reading throws InputError at `file`.
Json ToJson(const StudioModel& model);
StudioModel StudioModelFrom(const Json& json, const std::string& file);

}  // namespace sysid
