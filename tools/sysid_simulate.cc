// Makes a run from a model, with effects and noise
// (docs/interface.md section 1).

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <tuple>
#include <utility>

#include "gflags/gflags.h"
#include "models/dynamics.h"
#include "models/error.h"
#include "models/find_model.h"
#include "models/parameters.h"
#include "models/urdf/load_urdf.h"
#include "sysid/checks/model_findings.h"
#include "sysid/io/column_map.h"
#include "sysid/io/csv.h"
#include "sysid/io/memory.h"
#include "sysid/io/read_run.h"
#include "sysid/io/write_file.h"
#include "sysid/io/write_run.h"
#include "sysid/parameters/patterns.h"
#include "sysid/session/free_choice.h"
#include "sysid/session/named_values.h"
#include "sysid/session/session.h"
#include "sysid/simulation/reference.h"
#include "sysid/simulation/simulate.h"
#include "sysid/simulation/tracking.h"
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

void CheckPositive(const char* flag, double value, const char* hint) {
  if (!(value > 0 && std::isfinite(value))) {
    throw InputError(std::string("--") + flag,
                     "must be a positive number, not " + ShortestText(value),
                     hint);
  }
}

void CheckNumbers() {
  constexpr double kMostSamples = 1e7, kMostSteps = 1e8;
  CheckPositive("duration", FLAGS_duration, "give seconds, such as 10");
  CheckPositive("rate", FLAGS_rate, "give samples a second, such as 100");
  CheckPositive("tilt", FLAGS_tilt, "give radians (slides: m), such as 0.6");
  if (!(FLAGS_noise >= 0 && std::isfinite(FLAGS_noise))) {
    throw InputError(
        "--noise",
        "must not be negative, and finite, not " + ShortestText(FLAGS_noise),
        "give a standard deviation in rad or m, such as 1e-3");
  }
  const double samples = FLAGS_duration * FLAGS_rate;
  if (samples > kMostSamples) {
    throw InputError("--duration",
                     "times --rate makes " + ShortestText(samples) +
                         " samples; 1e7 are the most",
                     "give a shorter duration or a lower rate");
  }
  if (samples < 1) {
    throw InputError("--duration", "is shorter than one sample at --rate",
                     "give a longer duration or a higher rate");
  }
  if (!FlagGiven("step")) return;
  CheckPositive("step", FLAGS_step, "give seconds, or leave it out");
  if (FLAGS_duration / FLAGS_step > kMostSteps) {
    throw InputError(
        "--step",
        ShortestText(FLAGS_step) + " s makes more than 1e8 steps of --duration",
        "leave it out: it is then fine enough");
  }
}

// Adds the effects of --add and sets the values that they and --set give.
void ChangeModel(const Catalogue& catalogue, const std::string& file,
                 Model* model) {
  const bool was_singular = !SingularJoints(*model).empty();
  std::vector<NamedValue> values;
  for (const NamedValue& added :
       ExpandPatterns(SplitEffectValues(FLAGS_add, "--add"), &NamedValue::name,
                      EffectVocabulary(catalogue, model->mechanism()))) {
    const auto effect = catalogue.Make(added.name, model->mechanism(), "--add");
    if (!model->effects().Contains(added.name)) {
      model->AddEffect(effect, "--add");
    }
    if (added.value) {
      values.push_back(
          {effect->ParameterNames().front(), added.value, "--add"});
    }
  }
  for (const NamedValue& set :
       ExpandPatterns(SplitAssignments(FLAGS_set, "--set"), &NamedValue::name,
                      ParameterVocabulary(*model))) {
    if (!set.value) {
      throw InputError("--set", "'" + set.name + "' has no value",
                       "write " + set.name + "=number");
    }
    values.push_back(set);
  }
  const std::string faults = SetValues(values, model);
  if (!faults.empty()) {
    throw InputError("--set", "makes no possible body: " + faults,
                     "masses and moments are positive, and no moment exceeds "
                     "the sum of the other two");
  }
  CheckJoints(*model, was_singular ? file : "--set");
}

// The band of --band, Hz, low and high.
std::pair<double, double> Band() {
  constexpr char kHint[] = "write the lowest and the highest, such as 0.1,2";
  const std::vector<std::string> parts = SplitList(FLAGS_band, "--band");
  double low = 0.0, high = 0.0;
  if (parts.size() != 2 || !ParseNumber(parts[0], &low) ||
      !ParseNumber(parts[1], &high)) {
    throw InputError("--band", "'" + FLAGS_band + "' is no pair of frequencies",
                     kHint);
  }
  if (!(low > 0 && high > low && std::isfinite(high))) {
    throw InputError("--band",
                     "'" + FLAGS_band + "': 0 < lowest < highest must hold",
                     kHint);
  }
  if (high > 0.25 * FLAGS_rate) {
    throw InputError("--band",
                     ShortestText(high) + " Hz is more than a quarter of " +
                         ShortestText(FLAGS_rate) + " samples a second",
                     "give a higher --rate or a lower band");
  }
  return {low, high};
}

// What drives the joints: one of --excite, --efforts, --track.
void CheckDrives() {
  std::vector<std::string> drives;
  if (FLAGS_excite != "none") drives.push_back("--excite");
  if (!FLAGS_efforts.empty()) drives.push_back("--efforts");
  if (!FLAGS_track.empty()) drives.push_back("--track");
  if (drives.size() > 1) {
    throw InputError(drives[1], "cannot be given beside " + drives[0],
                     "leave one of them out");
  }
  for (const char* of_excite : {"amplitude", "band"}) {
    if (FlagGiven(of_excite) && FLAGS_excite == "none") {
      throw InputError(std::string("--") + of_excite,
                       "says nothing without --excite",
                       "add --excite multisine");
    }
  }
  if (FLAGS_track.empty() && !FLAGS_gains.empty()) {
    throw InputError("--gains", "say nothing without --track",
                     "add --track REFERENCE.csv");
  }
}

void FillExcitation(SimulationOptions* options) {
  if (FLAGS_excite == "none") return;
  if (FLAGS_excite != "multisine") {
    throw InputError("--excite", "unknown excitation '" + FLAGS_excite + "'",
                     NameHint(FLAGS_excite, {"none", "multisine"}));
  }
  CheckPositive("amplitude", FLAGS_amplitude,
                "1 uses all the room between limits, 0.5 half of it");
  options->excitation = Excitation::kWithinLimits;
  options->excitation_level *= FLAGS_amplitude;
  options->excursion = std::min(FLAGS_amplitude, 1.0);
  std::tie(options->lowest_frequency, options->highest_frequency) = Band();
}

// The state to start from, by --initial. A notice for each joint that the run's
// first row says nothing of.
Eigen::VectorXd Start(const Model& model, std::vector<std::string>* notices) {
  if (FLAGS_initial == "random") {
    return RandomState(model, FLAGS_tilt, FLAGS_seed);
  }
  if (!std::filesystem::exists(FLAGS_initial)) {
    throw InputError("--initial", "there is no run '" + FLAGS_initial + "'",
                     "name a run, whose first row is taken, or write random");
  }
  const Run run = ReadRun(FLAGS_initial, {}, model.mechanism(), notices);
  for (const Body& body : model.movers()) {
    const bool known = std::any_of(
        run.channels.begin(), run.channels.end(), [&](const Channel& c) {
          return (c.kind == ChannelKind::kPosition ||
                  c.kind == ChannelKind::kOrientation) &&
                 c.target == body.joint && !std::isnan(c.values(0, 0));
        });
    if (known) continue;
    notices->push_back(FLAGS_initial +
                       ": the first row has no position of "
                       "joint '" +
                       model.mechanism().joints[body.joint].name +
                       "': it starts at neutral");
  }
  return FirstState(model, run);
}

// Whether an effect of the model does nothing: what a screening would move is
// at null, or its link is the mechanism's own.
bool IsOff(const Model& model, int i) {
  const Effect& effect = model.effects().effect(i);
  const double* values =
      model.nominal().effects.data() + model.effects().offset(i);
  for (const ProbeSet& probes : effect.ProbeSets()) {
    for (const Probe& probe : probes) {
      const EffectParameter& along = effect.parameters()[probe.along];
      if (values[probe.along] != along.null_value) return false;
    }
  }
  if (effect.adjusts_nominal().empty()) return true;
  const Inertial<double>& own = model.mechanism().nominal.links[effect.link()];
  const Inertial<double>& now = model.nominal().links[effect.link()];
  return now.mass == own.mass && now.com == own.com &&
         now.inertia == own.inertia;
}

double ValueOfEffect(const Model& model, const std::string& name) {
  return FindParameters(model, {name}, "").front().nominal;
}

// What was asked for and does nothing, or not what it is named for.
void AddNotices(const Model& model, const SimulationOptions& options,
                std::vector<std::string>* notices) {
  for (int i = 0; i < model.effects().size(); ++i) {
    const Effect& effect = model.effects().effect(i);
    const std::string& target = effect.target();
    if (IsOff(model, i)) {
      const Parameter first =
          FindParameters(model, {effect.ParameterNames().front()}, "").front();
      const bool own = !effect.adjusts_nominal().empty();
      notices->push_back(
          "effect " + effect.name() + " is off: " +
          (own ? first.name + " is the model's own, " +
                     ShortestText(first.nominal) + " " + first.unit +
                     "; give it another value"
               : "give it a value") +
          ", --add " + effect.name() + "=" +
          ShortestText(own ? first.nominal + 0.1 * first.typical_scale
                           : first.typical_scale));
    } else if (effect.kind() == "stribeck_friction" &&
               ValueOfEffect(model, target + ".static_friction") <
                   ValueOfEffect(model, target + ".friction")) {
      notices->push_back(
          effect.name() + ": there is less friction at rest than in motion; " +
          "give more with --set " + target + ".static_friction=" +
          ShortestText(2 * ValueOfEffect(model, target + ".friction")));
    }
  }
  if (options.excitation == Excitation::kNone) return;
  for (const Body& body : model.movers()) {
    if (body.type != JointType::kSpherical) return;
  }
  notices->push_back(
      "--excite drives joints of one degree of freedom, and this model has "
      "none");
}

// The run, its states twice (two steps are compared), and its text.
void CheckSize(const Model& model) {
  constexpr double kCell = 24.0;  // characters of a number, at most
  const double columns = 1.0 + model.nq() + model.nv();
  const double numbers = columns + 2.0 * model.state_size();
  CheckMemory(FLAGS_duration * FLAGS_rate *
                  (sizeof(double) * numbers + kCell * columns),
              "--duration", "a run of that many samples",
              "give a shorter duration or a lower rate");
}

// As long as what is followed or applied, where --duration says nothing else.
void FillDuration(double duration, SimulationOptions* options) {
  if (FlagGiven("duration")) return;
  FLAGS_duration = options->duration = duration;
  CheckNumbers();
}

// The run of a controller that follows --track.
Run TrackReference(const Model& model, SimulationOptions options,
                   std::vector<std::string>* notices) {
  const Run file = ReadPositions(FLAGS_track, model.mechanism(), notices);
  JointReference reference(model, file);
  FillDuration(reference.duration(), &options);
  CheckSize(model);
  const double period = 1.0 / options.rate;
  Eigen::VectorXd x0 =
      FlagGiven("initial") ? Start(model, notices) : NearestToNeutral(model);
  const std::vector<std::string> missing = reference.Missing(model);
  reference.HoldOthers(model, x0);
  if (!FlagGiven("initial")) x0 = reference.Start(model, x0);
  if (!missing.empty()) {
    notices->push_back(FLAGS_track + ": no column of " + Join(missing) +
                       ": held where " +
                       (missing.size() == 1 ? "it starts" : "they start"));
  }
  const std::string suggested =
      "--gains '" + SuggestGains(model, reference, x0, period) + "'";
  if (FLAGS_gains.empty()) {
    throw InputError("--gains", "is missing",
                     "write kp,kd for all joints, or joint by joint; this "
                     "model's inertia suggests " +
                         suggested);
  }
  const std::vector<Gains> gains = ParseGains(FLAGS_gains, model, "--gains");
  return SimulateTracking(model, x0, options, reference, gains, suggested,
                          notices);
}

// The run under the efforts of --efforts.
Run ApplyEfforts(const Model& model, SimulationOptions options,
                 std::vector<std::string>* notices) {
  const Run efforts = ReadEfforts(FLAGS_efforts, model.mechanism(), notices);
  FillDuration(efforts.t.back() - efforts.t.front(), &options);
  CheckSize(model);
  double shortest = HUGE_VAL;
  for (int k = 1; k < efforts.size(); ++k) {
    shortest = std::min(shortest, efforts.t[k] - efforts.t[k - 1]);
  }
  if (shortest < (1 - 1e-6) / options.rate) {
    notices->push_back(FLAGS_efforts +
                       ": its rows are closer than the samples "
                       "of --rate, which hold theirs: to apply all of them, "
                       "--rate " +
                       RoundedText(std::ceil((1 - 1e-6) / shortest)));
  }
  const Run run =
      SimulateDriven(model, Start(model, notices), options, Replay(efforts));
  for (const std::string& notice : LimitNotices(model, run)) {
    notices->push_back(notice);
  }
  return run;
}

Run MakeRun(const Model& model, const SimulationOptions& options,
            std::vector<std::string>* notices) {
  if (!FLAGS_track.empty()) return TrackReference(model, options, notices);
  if (!FLAGS_efforts.empty()) return ApplyEfforts(model, options, notices);
  const Eigen::VectorXd x0 = Start(model, notices);
  CheckSize(model);
  return Simulate(model, x0, options);
}

// What the model's effects read, from --inputs.
void ReadInputsOf(const Model& model, SimulationOptions* options,
                  std::vector<std::string>* notices) {
  if (!FLAGS_inputs.empty()) {
    options->inputs = std::make_shared<const Run>(
        ReadInputs(FLAGS_inputs, model.mechanism(), notices));
    const Run& run = *options->inputs;
    if (FLAGS_efforts.empty() && FLAGS_track.empty()) {
      FillDuration(run.t.back() - run.t.front(), options);
    }
  }
  for (int i = 0; i < model.effects().size(); ++i) {
    const Effect& effect = model.effects().effect(i);
    for (const EffectInput& input : effect.inputs()) {
      if (input.name == "t" || (options->inputs != nullptr &&
                                HasInput(*options->inputs, input.name))) {
        continue;
      }
      throw InputError(
          "--inputs",
          effect.name() + " reads " + input.name + ", which is not there",
          "give a file with the columns t and " + input.name);
    }
  }
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
  CheckNumbers();
  CheckDrives();
  SimulationOptions options;
  options.duration = FLAGS_duration;
  options.rate = FLAGS_rate;
  options.noise = FLAGS_noise;
  options.motor_sensors = FLAGS_motor_sensors;
  options.seed = FLAGS_seed;
  options.step = FLAGS_step;
  options.integrator = ParseIntegrator(FLAGS_integrator, "--integrator");
  FillExcitation(&options);
  const Catalogue catalogue;
  std::string file;
  std::vector<std::string> notices;
  std::vector<NamedValue> locks = SplitAssignments(FLAGS_lock, "--lock");
  ColumnMap words;
  if (!FLAGS_inputs.empty()) {
    words = OwnInputColumns(FLAGS_inputs, LoadUrdf(FindModel(FLAGS_model)));
  }
  Model model =
      OpenModel(FLAGS_model, catalogue, &locks, &file, &notices, words);
  ChangeModel(catalogue, file, &model);
  ReadInputsOf(model, &options, &notices);
  for (const Finding& finding : ModelFindings(model, file)) {
    notices.push_back(BriefText(finding));
  }
  const bool to_stdout = IsStdout(FLAGS_out_csv);
  if (!to_stdout) {
    CheckIsNoInput(
        "--out_csv", FLAGS_out_csv,
        {file, FLAGS_initial, FLAGS_track, FLAGS_efforts, FLAGS_inputs});
    CheckWritableFile(FLAGS_out_csv);
  }
  AddNotices(model, options, &notices);
  const Run run = MakeRun(model, options, &notices);
  PrintNotices(notices);
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
  const std::string text = FormatRun(model.mechanism(), run, {command});
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
