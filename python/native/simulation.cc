#include <memory>
#include <stdexcept>
#include <utility>

#include "models/error.h"
#include "python/native/functions.h"
#include "sysid/api/simulate.h"
#include "sysid/io/write_run.h"
#include "sysid/session/named_values.h"

namespace sysid::python {
namespace {

// A recording of a request as a table that can be opened more than once.
TableSource SourceOf(const Call& call, const Json& json) {
  if (json.contains("file")) return FileSource(json["file"]);
  std::string name;
  std::vector<MemoryTable::Column> columns;
  size_t rows = 0;
  std::shared_ptr<const std::vector<NamedArray>> arrays;
  if (json.contains("table")) {
    const TableView& view = call.tables.at(json["table"]);
    name = view.name;
    rows = view.rows;
    columns = view.columns;
  } else {
    const auto& run = call.objects.at(json.at("object"))->run;
    if (run == nullptr) throw std::logic_error("no run");
    arrays = std::make_shared<const std::vector<NamedArray>>(
        ArraysOf(run->mechanism, run->run));
    name = run->run.name;
    rows = run->run.t.size();
    for (const NamedArray& array : *arrays) {
      columns.push_back({array.name, array.values.data(), 1});
    }
  }
  return {name, [name, rows, columns, arrays]() -> std::unique_ptr<TableFile> {
            return std::make_unique<MemoryTable>(name, rows, columns);
          }};
}

}  // namespace

Result SimulateRun(const Call& call) {
  SimulationRequest request;
  const ModelHandle& model = ModelIn(call, call.request.at("model"));
  request.model = model.name;
  request.model_in_memory = model.model;
  for (const auto& [name, value] : call.request.at("options").items()) {
    const std::string place = "--" + name;
    if (name == "lock") {
      request.lock = Assignments(value, place);
    } else if (name == "set") {
      request.set = Assignments(value, place);
    } else if (name == "add") {
      request.add = EffectValues(value, place);
    } else if (name == "initial" && value == "random") {
      request.at_random = true;
    } else if (name == "initial") {
      request.initial = SourceOf(call, value);
    } else if (name == "tilt") {
      request.tilt = Number(value, place);
    } else if (name == "duration") {
      request.duration = Number(value, place);
    } else if (name == "rate") {
      request.rate = Number(value, place);
    } else if (name == "noise") {
      request.noise = Number(value, place);
    } else if (name == "motor_sensors") {
      request.motor_sensors = Truth(value, place);
    } else if (name == "seed") {
      request.seed = Whole(value, place);
    } else if (name == "excite") {
      request.excite = Text(value, place);
    } else if (name == "efforts") {
      request.efforts = SourceOf(call, value);
    } else if (name == "track") {
      request.track = SourceOf(call, value);
    } else if (name == "inputs") {
      request.inputs = SourceOf(call, value);
    } else if (name == "amplitude") {
      request.amplitude = Number(value, place);
    } else if (name == "band") {
      request.band = Text(value, place);
    } else if (name == "gains") {
      request.gains = Text(value, place);
    } else if (name == "integrator") {
      request.integrator = ParseIntegrator(Text(value, place), place);
    } else if (name == "step") {
      request.step = Number(value, place);
    } else {
      throw InputError(
          name, "is no option",
          NameHint(name, {"lock", "set", "add", "initial", "tilt", "duration",
                          "rate", "noise", "motor_sensors", "seed", "excite",
                          "efforts", "track", "inputs", "amplitude", "band",
                          "gains", "integrator", "step"}));
    }
  }
  SimulationResult made = SimulateRecording(request);
  made.run.name = "simulation";
  return ResultOf(std::make_shared<const RunHandle>(RunHandle{
      std::move(made.run), made.model.mechanism(), std::move(made.notices)}));
}

}  // namespace sysid::python
