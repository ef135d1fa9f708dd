// Gathers the results of many robots into a table and a page (docs/fleet.md).

#include <unistd.h>

#include <filesystem>

#include "gflags/gflags.h"
#include "models/error.h"
#include "sysid/fleet/fleet.h"
#include "sysid/io/write_file.h"
#include "sysid/session/named_values.h"
#include "tools/program.h"

DEFINE_string(fits, "", "diagnosis.json or fit.json of each robot");
DEFINE_string(out, "", "folder for fleet.json and fleet.html");
DEFINE_string(json, "", "result as JSON; - is standard output");

namespace sysid {
namespace {

constexpr char kHelp[] =
    R"(sysid_fleet: the results of many robots in one table

  sysid_fleet --fits 'fleet/*/diagnosis.json' --out fleet

  --fits FILES,...           diagnosis.json of each robot (with the fit.json
                             beside it), or its fit.json; by pattern, which
                             also names the folders that have neither
  --out DIR                  fleet.json, and fleet.html to look at
  --json FILE|-              machine-readable result
It names the robots that miss an effect and those with a broken recording, the
mean of each parameter with the spread between robots, outliers, and drifts over
the dates of the recordings (docs/fleet.md). examples/fleet runs sysid_check,
sysid_fit, sysid_diagnose and this program on all robots of a folder.
Exit code: 0 done, 2 bad input.
)";

int Main() {
  if (FLAGS_fits.empty()) {
    throw InputError("--fits", "is missing",
                     "name the results of each robot: --fits "
                     "'fleet/*/diagnosis.json'");
  }
  const Fleet fleet = AnalyseFleet(ReadFleet(SplitList(FLAGS_fits, "--fits")));
  const bool to_stdout = IsStdout(FLAGS_json);
  const std::string json = FleetJson(fleet);
  if (!FLAGS_json.empty() && !to_stdout) {
    std::vector<std::string> inputs;
    for (const Robot& robot : fleet.robots) inputs.push_back(robot.file);
    CheckIsNoInput("--json", FLAGS_json, inputs);
    CheckWritableFile(FLAGS_json);
  }
  if (!FLAGS_out.empty()) {
    CheckWritableFolder(FLAGS_out, "--out");
    const std::filesystem::path out(FLAGS_out);
    WriteFileAtomically((out / "fleet.json").string(), json);
    WriteFileAtomically((out / "fleet.html").string(), FleetHtml(fleet));
  }
  if (!FLAGS_json.empty() && !to_stdout) WriteFileAtomically(FLAGS_json, json);
  WriteStdout(to_stdout ? json : FleetText(fleet, isatty(STDOUT_FILENO) == 1));
  return kExitDone;
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  return sysid::RunProgram(argc, argv, sysid::kHelp, sysid::Main);
}
