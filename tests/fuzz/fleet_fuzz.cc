// Results that sysid_fleet gathers: fit.json and diagnosis.json, and lists of
// runs.

#include <cmath>
#include <filesystem>
#include <fstream>

#include "sysid/fleet/read_fleet.h"
#include "sysid/session/run_list.h"
#include "tests/fuzz/fuzz.h"

namespace sysid {
namespace {

namespace fs = std::filesystem;

// A folder of this process, with robots.
const fs::path& Folder() {
  static const fs::path& folder = *new fs::path([] {
    std::string name = (fs::temp_directory_path() / "fuzz_fleet_XXXXXX");
    FUZZ_EXPECT(mkdtemp(name.data()) != nullptr);
    fs::create_directories(fs::path(name) / "diagnosed");
    fs::create_directories(fs::path(name) / "fitted");
    std::atexit([] { fs::remove_all(Folder()); });
    return fs::path(name);
  }());
  return folder;
}

void Write(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

void ExpectValid(const std::vector<Robot>& robots) {
  for (const Robot& robot : robots) {
    FUZZ_EXPECT(!robot.name.empty());
    ExpectPrintable(robot.broken);
    ExpectPrintable(robot.not_compared);
    for (const RobotParameter& parameter : robot.parameters) {
      ExpectPrintable(parameter.unusable);
      if (!parameter.unusable.empty()) continue;
      FUZZ_EXPECT(std::isfinite(parameter.estimate.value));
      FUZZ_EXPECT(parameter.estimate.std_error > 0.0 &&
                  std::isfinite(parameter.estimate.std_error));
    }
  }
}

}  // namespace
}  // namespace sysid

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {
  using namespace sysid;
  const std::string text = TextOf(data, size);
  const fs::path diagnosis = Folder() / "diagnosed" / "diagnosis.json";
  const fs::path fit = Folder() / "fitted" / "fit.json";
  const fs::path list = Folder() / "runs.txt";
  Write(diagnosis, text);
  Write(fit, text);
  Write(list, text);
  for (const std::string& named :
       {diagnosis.string(), fit.string(), (Folder() / "*/*.json").string()}) {
    try {
      ExpectValid(ReadFleet({named}));
    } catch (const InputError& error) {
      ExpectReadable(error);
    }
  }
  // A pattern from the root may meet the whole disk.
  if (text.find('/') != std::string::npos) return 0;
  try {
    for (const std::string& run : ExpandRuns({"@" + list.string()}, "--traj")) {
      FUZZ_EXPECT(!run.empty());
    }
  } catch (const InputError& error) {
    ExpectReadable(error);
  }
  return 0;
}
