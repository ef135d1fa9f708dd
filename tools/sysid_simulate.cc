// Makes a run from a model, with effects and noise
// (docs/interface.md section 1).

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "gflags/gflags.h"
#include "models/dynamics.h"
#include "models/error.h"
#include "models/find_model.h"
#include "models/parameters.h"
#include "sysid/checks/model_findings.h"
#include "sysid/io/csv.h"
#include "sysid/io/memory.h"
#include "sysid/io/read_run.h"
#include "sysid/io/write_file.h"
#include "sysid/io/write_run.h"
#include "sysid/session/free_choice.h"
#include "sysid/session/named_values.h"
#include "sysid/session/session.h"
#include "sysid/simulation/simulate.h"
#include "tools/program.h"

DEFINE_string(model, "", "shipped model's name, or a URDF file");
DEFINE_string(lock, "", "joints to hold still, name or name=position");
DEFINE_string(set, "", "values of parameters, name=value");
DEFINE_string(add, "", "effects, effect@target=value of the first parameter");
DEFINE_string(initial, "random", "random, or a run whose first row it is");
DEFINE_double(tilt, 0.6, "largest angle of a random start, rad (slides: m)");
DEFINE_double(duration, 10, "s");
DEFINE_double(rate, 100, "samples a second, Hz");
DEFINE_double(noise, 1e-3, "standard deviation of a measurement, rad or m");
DEFINE_uint64(seed, 1, "every random draw derives from it");
DEFINE_string(excite, "none", "none or multisine");
DEFINE_string(integrator, "rk4", "rk4 or semi_implicit_euler");
DEFINE_double(step, 0, "integration step, s; 0: fine enough");
DEFINE_string(out_csv, "", "the run");

namespace sysid {
namespace {

constexpr char kHelp[] =
    R"(sysid_simulate: make a recording from a model

  sysid_simulate --model pendulum2 --set link1.length=0.81,link2.length=0.304
      --add viscous_damping@joint1=0.02 --noise 1e-3 --out_csv run.csv

  --model NAME|FILE.urdf     a shipped model (pendulum1..3, pendulum2_planar,
                             pendulum3_planar, cartpole, arm7) or a URDF
  --lock 'wheel_*,head=0.3'  joints held still
  --set name=value,...       parameters, also those of effects
  --add effect@target=v,...  effects, with the value of their first parameter
      on joints: viscous_damping, coulomb_friction, stribeck_friction,
          quadratic_drag, spring, armature, effort_bias, effort_gain, cogging,
          sensor_offset
      on links:  aerodynamic_drag, mass, com, inertia
      on base:   effort_delay, gravity_tilt
  --initial random|RUN.csv   start at rest at random angles, or as the first
                             row of a run (velocities where it has them)
  --tilt 0.6                 largest angle of a random start, rad (slides: m)
  --duration 10  --rate 100  s, Hz
  --noise 1e-3               of a measurement, rad or m
  --seed 1                   every random draw derives from it
  --excite none|multisine    efforts on the joints of one degree of freedom
  --integrator rk4|semi_implicit_euler    --step S (default: fine enough)
  --out_csv run.csv          the run; - is standard output
Exit code: 0 done, 2 bad input.
)";

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
  for (const NamedValue& added : SplitAssignments(FLAGS_add, "--add")) {
    const auto effect = catalogue.Make(added.name, model->mechanism(), "--add");
    if (!model->effects().Contains(added.name)) {
      model->AddEffect(effect, "--add");
    }
    if (added.value) {
      values.push_back(
          {effect->ParameterNames().front(), added.value, "--add"});
    }
  }
  for (const NamedValue& set : SplitAssignments(FLAGS_set, "--set")) {
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
  for (const Body& body : model.bodies()) {
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
  for (const Body& body : model.bodies()) {
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
  SimulationOptions options;
  options.duration = FLAGS_duration;
  options.rate = FLAGS_rate;
  options.noise = FLAGS_noise;
  options.seed = FLAGS_seed;
  options.step = FLAGS_step;
  options.integrator = ParseIntegrator(FLAGS_integrator, "--integrator");
  if (FLAGS_excite == "multisine") {
    options.excitation = Excitation::kMultisine;
  } else if (FLAGS_excite != "none") {
    throw InputError("--excite", "unknown excitation '" + FLAGS_excite + "'",
                     NameHint(FLAGS_excite, {"none", "multisine"}));
  }
  const Catalogue catalogue;
  std::string file;
  std::vector<std::string> notices;
  std::vector<NamedValue> locks = SplitAssignments(FLAGS_lock, "--lock");
  Model model = OpenModel(FLAGS_model, catalogue, &locks, &file, &notices);
  ChangeModel(catalogue, file, &model);
  for (const Finding& finding : ModelFindings(model, file)) {
    notices.push_back(BriefText(finding));
  }
  const Eigen::VectorXd x0 = Start(model, &notices);
  const bool to_stdout = IsStdout(FLAGS_out_csv);
  if (!to_stdout) {
    CheckIsNoInput("--out_csv", FLAGS_out_csv, {file, FLAGS_initial});
    CheckWritableFile(FLAGS_out_csv);
  }
  CheckSize(model);
  AddNotices(model, options, &notices);
  PrintNotices(notices);
  const Run run = Simulate(model, x0, options);
  std::string command = "sysid_simulate";
  for (const char* name :
       {"model", "lock", "set", "add", "initial", "tilt", "duration", "rate",
        "noise", "seed", "excite", "integrator", "step"}) {
    // As it was written: gflags prints 0.0005 as 0.00050000000000000001.
    if (FlagGiven(name)) {
      command += std::string(" --") + name + " " + FlagText(name);
    }
  }
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
