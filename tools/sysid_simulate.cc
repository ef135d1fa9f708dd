// Makes a run from a model, with effects and noise
// (docs/interface.md section 1).

#include <filesystem>
#include <string>

#include "gflags/gflags.h"
#include "models/error.h"
#include "models/find_model.h"
#include "sysid/api/simulate.h"
#include "sysid/io/write_file.h"
#include "sysid/io/write_run.h"
#include "sysid/session/named_values.h"
#include "tools/program.h"
#include "tools/simulate_help.h"

DEFINE_string(model, "", "shipped model's name, or a URDF file");
DEFINE_string(lock, "", "joints to hold still, name or name=position");
DEFINE_string(set, "", "values of parameters, name=value");
DEFINE_string(add, "", "effects, effect@target=value of the first parameter");
DEFINE_string(initial, "random", "random, or a run whose first row it is");
DEFINE_double(tilt, 0.6, "largest angle of a random start, rad (slides: m)");
DEFINE_double(duration, 10, "s");
DEFINE_double(rate, 100, "samples a second, Hz");
DEFINE_double(noise, 1e-3, "standard deviation of a measurement, rad or m");
DEFINE_bool(motor_sensors, false, "also what sensors at motors say, J.motor_q");
DEFINE_uint64(seed, 1, "every random draw derives from it");
DEFINE_string(excite, "none", "none or multisine");
DEFINE_double(amplitude, 1, "of --excite: 1 uses the room between limits");
DEFINE_string(band, "0.1,2", "of --excite: lowest and highest frequency, Hz");
DEFINE_string(efforts, "", "a file with the efforts to apply, J.tau");
DEFINE_string(inputs, "",
              "a file with what effects read: J.cmd, J.temperature, base.ax, "
              "...");
DEFINE_string(track, "", "a file with positions to follow, J.q");
DEFINE_string(gains, "", "of --track: kp,kd, or joint=kp:kd,...");
DEFINE_string(integrator, "rk4", "rk4, semi_implicit_euler or ros2");
DEFINE_double(step, 0, "integration step, s; 0: fine enough");
DEFINE_string(out_csv, "", "the run");

namespace sysid {
namespace {

// The first row of a run, or at random.
void FillInitial(SimulationRequest* request) {
  request->at_random = FlagGiven("initial") && FLAGS_initial == "random";
  if (FLAGS_initial == "random") return;
  if (!std::filesystem::exists(FLAGS_initial)) {
    throw InputError("--initial", "there is no run '" + FLAGS_initial + "'",
                     "name a run, whose first row is taken, or write random");
  }
  request->initial = FileSource(FLAGS_initial);
}

SimulationRequest RequestFromFlags() {
  SimulationRequest request;
  request.model = FLAGS_model;
  request.lock = SplitAssignments(FLAGS_lock, "--lock");
  request.set = SplitAssignments(FLAGS_set, "--set");
  request.add = SplitEffectValues(FLAGS_add, "--add");
  FillInitial(&request);
  request.tilt = FLAGS_tilt;
  if (FlagGiven("duration")) request.duration = FLAGS_duration;
  request.rate = FLAGS_rate;
  request.noise = FLAGS_noise;
  request.motor_sensors = FLAGS_motor_sensors;
  request.seed = FLAGS_seed;
  request.excite = FLAGS_excite;
  request.efforts = FileSource(FLAGS_efforts);
  request.track = FileSource(FLAGS_track);
  if (FlagGiven("amplitude")) request.amplitude = FLAGS_amplitude;
  if (FlagGiven("band")) request.band = FLAGS_band;
  request.gains = FLAGS_gains;
  request.inputs = FileSource(FLAGS_inputs);
  request.integrator = ParseIntegrator(FLAGS_integrator, "--integrator");
  if (FlagGiven("step")) request.step = FLAGS_step;
  return request;
}

// The command that made the run, for its first line.
std::string CommandText() {
  std::string command = "sysid_simulate";
  for (const char* name :
       {"model", "lock", "set", "add", "initial", "tilt", "duration", "rate",
        "noise", "seed", "excite", "amplitude", "band", "efforts", "inputs",
        "track", "gains", "integrator", "step"}) {
    // As it was written: gflags prints 0.0005 as 0.00050000000000000001.
    if (FlagGiven(name)) {
      command += std::string(" --") + name + " " + ShellWord(FlagText(name));
    }
  }
  if (FLAGS_motor_sensors) command += " --motor_sensors";
  return command;
}

int Main() {
  if (FLAGS_model.empty()) {
    throw InputError(
        "--model", "is missing",
        "give a URDF file or a shipped model: " + Join(ShippedModels()));
  }
  if (FLAGS_out_csv.empty()) {
    throw InputError("--out_csv", "is missing",
                     "name the file to write, or - for standard output");
  }
  const bool to_stdout = IsStdout(FLAGS_out_csv);
  const SimulationResult result = SimulateRecording(
      RequestFromFlags(), Catalogue(), [&](const std::string& model_file) {
        if (to_stdout) return;
        CheckIsNoInput("--out_csv", FLAGS_out_csv,
                       {model_file, FLAGS_initial, FLAGS_track, FLAGS_efforts,
                        FLAGS_inputs});
        CheckWritableFile(FLAGS_out_csv);
      });
  PrintNotices(result.notices);
  const std::string text =
      FormatRun(result.model.mechanism(), result.run, {CommandText()});
  if (to_stdout) {
    WriteStdout(text);
  } else {
    WriteFileAtomically(FLAGS_out_csv, text);
  }
  return kExitDone;
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  return sysid::RunProgram(argc, argv, sysid::kHelp, sysid::Main);
}
