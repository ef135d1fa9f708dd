#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "models/effects/catalogue.h"
#include "models/integrator.h"
#include "models/model.h"
#include "residuals/run.h"
#include "sysid/io/table_file.h"
#include "sysid/parameters/fit_specification.h"

namespace sysid {

// A recording that is yet to be opened: a file, or one in memory. None where
// `open` is empty.
struct TableSource {
  std::string name;
  std::function<std::unique_ptr<TableFile>()> open = {};
  bool is_given() const { return static_cast<bool>(open); }
};
// A file's; one without a name is none.
TableSource FileSource(const std::string& path);

// A recording of a model: all that sysid_simulate does but read flags and
// write. Values say what the flags of docs/simulation.md say, and errors name
// those. SI units.
struct SimulationRequest {
  // A shipped model's name, or a URDF file; or a model in memory.
  std::string model;
  std::shared_ptr<const Model> model_in_memory = nullptr;
  std::vector<NamedValue> lock = {};
  std::vector<NamedValue> set = {};  // each has a value
  std::vector<NamedValue> add =
      {};  // with that of the first parameter, or none
  // The start: the first row of a recording, or at random. Where neither is
  // said, at random, or at the beginning of what is followed.
  TableSource initial = {};
  bool at_random = false;
  double tilt = 0.6;                    // rad or m
  std::optional<double> duration = {};  // s; 10, or as long as what is followed
  double rate = 100.0;                  // Hz
  double noise = 1e-3;                  // rad or m
  bool motor_sensors = false;
  std::uint64_t seed = 1;
  // What drives the joints: one of these, or nothing.
  std::string excite = "none";  // or multisine
  TableSource efforts = {}, track = {};
  std::optional<double> amplitude = {};  // of excite; 1
  std::string band = {};                 // so too; "0.1,2", Hz
  std::string gains = {};                // of track
  TableSource inputs = {};               // what effects read
  Integrator integrator = Integrator::kRungeKutta4;
  std::optional<double> step = {};  // s; fine enough
};

struct SimulationResult {
  Run run;
  Model model;  // that made it
  std::string model_file;
  std::vector<std::string> notices;
};

// Throws InputError for what is wrong with the request or what it names.
// `ready` (may be empty) is called before the long work, with the model's file.
SimulationResult SimulateRecording(
    const SimulationRequest& request, const Catalogue& catalogue = Catalogue(),
    const std::function<void(const std::string& model_file)>& ready = {});

}  // namespace sysid
