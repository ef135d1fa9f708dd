#include "tests/acceptance/hidden/export_case.h"

#include <filesystem>

#include "models/urdf/write_urdf.h"
#include "sysid/io/csv.h"
#include "sysid/io/write_file.h"
#include "sysid/io/write_run.h"

namespace sysid {

void ExportCase(const HiddenData& data, const std::string& folder) {
  std::filesystem::create_directories(folder);
  const auto write = [&](const std::string& name, const std::string& text) {
    WriteFileAtomically((std::filesystem::path(folder) / name).string(), text);
  };
  const Model& plain = data.mechanism.plain;
  write("model.urdf", WriteUrdf(plain));
  std::string spec = "model: model.urdf\nfree:\n";
  for (const FreeParameter& free : data.mechanism.free) {
    spec += "  " + free.parameter.name +
            ": {initial: " + ShortestText(free.initial) +
            ", lower: " + ShortestText(free.lower) +
            ", upper: " + ShortestText(free.upper) + "}\n";
  }
  write("spec.yaml", spec);
  for (const sysid::Run& run : data.train) {
    write(run.name, FormatRun(plain.mechanism(), run));
  }
  write(data.holdout.name, FormatRun(plain.mechanism(), data.holdout));
  std::string truth =
      data.info.name + "\nnoise " + ShortestText(data.info.noise) + "\n";
  for (const FreeParameter& free : data.mechanism.free) {
    const Parameter parameter =
        FindParameters(data.truth, {free.parameter.name}, "test").front();
    truth += parameter.name + " " + ShortestText(parameter.nominal) + "\n";
  }
  for (const PlantedEffect& effect : data.planted) {
    truth += effect.name + "\n";
    for (const auto& [name, value] : effect.values) {
      truth += "  " + name + " " + ShortestText(value) + "\n";
    }
  }
  write("truth.txt", truth);
}

}  // namespace sysid
