#include "tests/fuzz/studio_doubles.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "models/model.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/report/page_data.h"
#include "tests/fuzz/fuzz_mechanism.h"

namespace sysid {

// The doubles, with the signatures of the real ones.

std::vector<ModelFile> ModelFiles() {
  return {{"identified.urdf", "application/xml"}};
}

Json PageHeader(const PageSource&) {
  return {{"schema", "sysid.page/1"},
          {"models", Json::array()},
          {"steps", Json::array()}};
}

PageSource SourceOf(const StudioSetup& setup) { return setup.page; }

StudioModel FitStudioModel(const StudioSetup&, const StudioChange& change,
                           int id, const std::stop_token& stop,
                           const std::function<void(const Progress&)>& report) {
  report({"fitting", 1, 2, 1.5});
  ThrowIfCancelled(stop);
  return FuzzStudioModel(change, id);
}

// What the targets use.

StudioModel FuzzStudioModel(const StudioChange& change, int id) {
  StudioModel model;
  model.id = id;
  if (change.from != nullptr) {
    model.parent = change.from->id;
    model.effects = change.from->effects;
    model.step = {{"title", change.Title()}};
  }
  for (const std::string& name : change.add) model.effects.push_back(name);
  std::erase(model.effects, change.remove);
  model.start.values["a.friction"] = 0.125;
  model.start.without_influence.insert("a.damping");
  for (const char* name : {"coulomb_friction@a", "viscous_damping@a",
                           "gravity_tilt@base", "mass@link_s"}) {
    model.candidates[name].values["a.friction"] = 0.5;
  }
  model.page = {{"id", id},
                {"trainError", 1.5},
                {"holdoutError", nullptr},
                {"candidates", Json::array()}};
  model.files["identified.urdf"] = "<robot/>";
  return model;
}

std::string FuzzFolder() {
  static const std::string& folder = *new std::string([] {
    const std::string base =
        std::filesystem::is_directory("/dev/shm") ? "/dev/shm" : "/tmp";
    return base + "/sysid-fuzz-" + std::to_string(getpid());
  }());
  static const bool registered = [] {
    std::atexit([] {
      std::error_code ignored;
      std::filesystem::remove_all(FuzzFolder(), ignored);
    });
    std::filesystem::create_directories(folder);
    return true;
  }();
  (void)registered;
  return folder;
}

StudioSetup FuzzStudioSetup(const std::string& folder) {
  const std::string robot = FuzzFolder() + "/robot.urdf";
  static const bool written = [&] {
    std::ofstream(robot) << "<robot/>";
    return true;
  }();
  (void)written;
  Session session{Model(FuzzMechanism())};
  session.model_name = "fuzz";
  session.model_file = robot;
  Run run;
  run.name = "a.csv";
  run.t = {0.0, 0.1};
  session.runs.push_back(run);
  StudioSetup setup(session);
  setup.page.program = "sysid_studio";
  setup.page.command = "sysid_studio --model fuzz";
  setup.folder = folder;
  return setup;
}

}  // namespace sysid
