#include "sysid/api/simulate.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "models/dynamics.h"
#include "models/error.h"
#include "models/find_model.h"
#include "models/parameters.h"
#include "models/urdf/load_urdf.h"
#include "sysid/checks/model_findings.h"
#include "sysid/io/cell.h"
#include "sysid/io/column_map.h"
#include "sysid/io/csv.h"
#include "sysid/io/memory.h"
#include "sysid/io/read_run.h"
#include "sysid/parameters/patterns.h"
#include "sysid/session/free_choice.h"
#include "sysid/session/named_values.h"
#include "sysid/session/session.h"
#include "sysid/simulation/reference.h"
#include "sysid/simulation/simulate.h"
#include "sysid/simulation/tracking.h"

namespace sysid {

TableSource FileSource(const std::string& path) {
  if (path.empty()) return {};
  return {path, [path] { return OpenTable(path); }};
}

namespace {

Run ReadSource(const TableSource& source, RunContent content,
               const Model& model, std::vector<std::string>* notices) {
  Run run = ReadTable(source.open(), {}, model.mechanism(), notices, content);
  run.name = source.name;  // with the topic of a bag
  return run;
}

void CheckPositive(const char* flag, double value, const char* hint) {
  if (!(value > 0 && std::isfinite(value))) {
    throw InputError(std::string("--") + flag,
                     "must be a positive number, not " + ShortestText(value),
                     hint);
  }
}

void CheckNumbers(const SimulationRequest& request, double duration) {
  constexpr double kMostSamples = 1e7, kMostSteps = 1e8;
  CheckPositive("duration", duration, "give seconds, such as 10");
  CheckPositive("rate", request.rate, "give samples a second, such as 100");
  CheckPositive("tilt", request.tilt, "give radians (slides: m), such as 0.6");
  if (!(request.noise >= 0 && std::isfinite(request.noise))) {
    throw InputError(
        "--noise",
        "must not be negative, and finite, not " + ShortestText(request.noise),
        "give a standard deviation in rad or m, such as 1e-3");
  }
  const double samples = duration * request.rate;
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
  if (!request.step) return;
  CheckPositive("step", *request.step, "give seconds, or leave it out");
  if (duration / *request.step > kMostSteps) {
    throw InputError("--step",
                     ShortestText(*request.step) +
                         " s makes more than 1e8 steps of --duration",
                     "leave it out: it is then fine enough");
  }
}

// Adds the effects of --add and sets the values that they and --set give.
void ChangeModel(const SimulationRequest& request, const Catalogue& catalogue,
                 const std::string& file, Model* model) {
  const bool was_singular = !SingularJoints(*model).empty();
  std::vector<NamedValue> values;
  for (const NamedValue& added :
       ExpandPatterns(EachOnce(request.add, "--add"), &NamedValue::name,
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
       ExpandPatterns(EachOnce(request.set, "--set"), &NamedValue::name,
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
std::pair<double, double> Band(const SimulationRequest& request) {
  const std::string band = request.band.empty() ? "0.1,2" : request.band;
  constexpr char kHint[] = "write the lowest and the highest, such as 0.1,2";
  const std::vector<std::string> parts = SplitList(band, "--band");
  double low = 0.0, high = 0.0;
  if (parts.size() != 2 || !ParseNumber(parts[0], &low) ||
      !ParseNumber(parts[1], &high)) {
    throw InputError("--band", "'" + band + "' is no pair of frequencies",
                     kHint);
  }
  if (!(low > 0 && high > low && std::isfinite(high))) {
    throw InputError("--band", "'" + band + "': 0 < lowest < highest must hold",
                     kHint);
  }
  if (high > 0.25 * request.rate) {
    throw InputError("--band",
                     ShortestText(high) + " Hz is more than a quarter of " +
                         ShortestText(request.rate) + " samples a second",
                     "give a higher --rate or a lower band");
  }
  return {low, high};
}

// What drives the joints: one of --excite, --efforts, --track.
void CheckDrives(const SimulationRequest& request) {
  std::vector<std::string> drives;
  if (request.excite != "none") drives.push_back("--excite");
  if (request.efforts.is_given()) drives.push_back("--efforts");
  if (request.track.is_given()) drives.push_back("--track");
  if (drives.size() > 1) {
    throw InputError(drives[1], "cannot be given beside " + drives[0],
                     "leave one of them out");
  }
  if (request.excite == "none" &&
      (request.amplitude || !request.band.empty())) {
    throw InputError(request.amplitude ? "--amplitude" : "--band",
                     "says nothing without --excite", "add --excite multisine");
  }
  if (!request.track.is_given() && !request.gains.empty()) {
    throw InputError("--gains", "say nothing without --track",
                     "add --track REFERENCE.csv");
  }
}

void FillExcitation(const SimulationRequest& request,
                    SimulationOptions* options) {
  if (request.excite == "none") return;
  if (request.excite != "multisine") {
    throw InputError("--excite", "unknown excitation '" + request.excite + "'",
                     NameHint(request.excite, {"none", "multisine"}));
  }
  const double amplitude = request.amplitude.value_or(1.0);
  CheckPositive("amplitude", amplitude,
                "1 uses all the room between limits, 0.5 half of it");
  options->excitation = Excitation::kWithinLimits;
  options->excitation_level *= amplitude;
  options->excursion = std::min(amplitude, 1.0);
  std::tie(options->lowest_frequency, options->highest_frequency) =
      Band(request);
}

// The state to start from, by --initial. A notice for each joint that the run's
// first row says nothing of.
Eigen::VectorXd Start(const SimulationRequest& request, const Model& model,
                      std::vector<std::string>* notices) {
  if (!request.initial.is_given()) {
    return RandomState(model, request.tilt, request.seed);
  }
  const Run run =
      ReadSource(request.initial, RunContent::kMeasurements, model, notices);
  for (const Body& body : model.movers()) {
    const bool known = std::any_of(
        run.channels.begin(), run.channels.end(), [&](const Channel& c) {
          return (c.kind == ChannelKind::kPosition ||
                  c.kind == ChannelKind::kOrientation) &&
                 c.target == body.joint && !std::isnan(c.values(0, 0));
        });
    if (known) continue;
    notices->push_back(request.initial.name +
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
void CheckSize(const Model& model, const SimulationOptions& options) {
  constexpr double kCell = 24.0;  // characters of a number, at most
  const double columns = 1.0 + model.nq() + model.nv();
  const double numbers = columns + 2.0 * model.state_size();
  CheckMemory(options.duration * options.rate *
                  (sizeof(double) * numbers + kCell * columns),
              "--duration", "a run of that many samples",
              "give a shorter duration or a lower rate");
}

// As long as what is followed or applied, where nothing else is said.
void FillDuration(const SimulationRequest& request, double duration,
                  SimulationOptions* options) {
  if (request.duration) return;
  options->duration = duration;
  CheckNumbers(request, duration);
}

// The run of a controller that follows --track.
Run TrackReference(const SimulationRequest& request, const Model& model,
                   SimulationOptions options,
                   std::vector<std::string>* notices) {
  const Run file =
      ReadSource(request.track, RunContent::kPositions, model, notices);
  JointReference reference(model, file);
  FillDuration(request, reference.duration(), &options);
  CheckSize(model, options);
  const double period = 1.0 / options.rate;
  const bool has_start = request.at_random || request.initial.is_given();
  Eigen::VectorXd x0 =
      has_start ? Start(request, model, notices) : NearestToNeutral(model);
  const std::vector<std::string> missing = reference.Missing(model);
  reference.HoldOthers(model, x0);
  if (!has_start) x0 = reference.Start(model, x0);
  if (!missing.empty()) {
    notices->push_back(request.track.name + ": no column of " + Join(missing) +
                       ": held where " +
                       (missing.size() == 1 ? "it starts" : "they start"));
  }
  const std::string suggested =
      "--gains '" + SuggestGains(model, reference, x0, period) + "'";
  if (request.gains.empty()) {
    throw InputError("--gains", "is missing",
                     "write kp,kd for all joints, or joint by joint; this "
                     "model's inertia suggests " +
                         suggested);
  }
  const std::vector<Gains> gains = ParseGains(request.gains, model, "--gains");
  return SimulateTracking(model, x0, options, reference, gains, suggested,
                          notices);
}

// The run under the efforts of --efforts.
Run ApplyEfforts(const SimulationRequest& request, const Model& model,
                 SimulationOptions options, std::vector<std::string>* notices) {
  const Run efforts =
      ReadSource(request.efforts, RunContent::kEfforts, model, notices);
  FillDuration(request, efforts.t.back() - efforts.t.front(), &options);
  CheckSize(model, options);
  double shortest = HUGE_VAL;
  for (int k = 1; k < efforts.size(); ++k) {
    shortest = std::min(shortest, efforts.t[k] - efforts.t[k - 1]);
  }
  if (shortest < (1 - 1e-6) / options.rate) {
    notices->push_back(request.efforts.name +
                       ": its rows are closer than the samples "
                       "of --rate, which hold theirs: to apply all of them, "
                       "--rate " +
                       RoundedText(std::ceil((1 - 1e-6) / shortest)));
  }
  const Run run = SimulateDriven(model, Start(request, model, notices), options,
                                 Replay(efforts));
  for (const std::string& notice : LimitNotices(model, run)) {
    notices->push_back(notice);
  }
  return run;
}

Run MakeRun(const SimulationRequest& request, const Model& model,
            const SimulationOptions& options,
            std::vector<std::string>* notices) {
  if (request.track.is_given()) {
    return TrackReference(request, model, options, notices);
  }
  if (request.efforts.is_given()) {
    return ApplyEfforts(request, model, options, notices);
  }
  const Eigen::VectorXd x0 = Start(request, model, notices);
  CheckSize(model, options);
  return Simulate(model, x0, options);
}

// What the model's effects read, from --inputs.
void ReadInputsOf(const SimulationRequest& request, const Model& model,
                  SimulationOptions* options,
                  std::vector<std::string>* notices) {
  if (request.inputs.is_given()) {
    options->inputs = std::make_shared<const Run>(
        ReadSource(request.inputs, RunContent::kInputs, model, notices));
    const Run& run = *options->inputs;
    if (!request.efforts.is_given() && !request.track.is_given()) {
      FillDuration(request, run.t.back() - run.t.front(), options);
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

// The model, with joints held still and what its effects may read.
Model OpenSimulated(const SimulationRequest& request,
                    const Catalogue& catalogue, std::string* file,
                    std::vector<std::string>* notices) {
  const std::shared_ptr<const Model>& given = request.model_in_memory;
  if (request.model.empty() && given == nullptr) {
    throw InputError(
        "--model", "is missing",
        "give a URDF file or a shipped model: " + Join(ShippedModels()));
  }
  ColumnMap words;
  if (request.inputs.is_given()) {
    words = OwnInputColumns(
        *request.inputs.open(),
        given ? given->mechanism() : LoadUrdf(FindModel(request.model)));
  }
  std::vector<NamedValue> locks = EachOnce(request.lock, "--lock");
  return given ? AdaptModel(*given, catalogue, &locks, notices, words)
               : OpenModel(request.model, catalogue, &locks, file, notices,
                           words);
}

}  // namespace

SimulationResult SimulateRecording(
    const SimulationRequest& request, const Catalogue& catalogue,
    const std::function<void(const std::string& model_file)>& ready) {
  SimulationOptions options;
  options.duration = request.duration.value_or(10.0);
  CheckNumbers(request, options.duration);
  CheckDrives(request);
  options.rate = request.rate;
  options.noise = request.noise;
  options.motor_sensors = request.motor_sensors;
  options.seed = request.seed;
  options.step = request.step.value_or(0.0);
  options.integrator = request.integrator;
  FillExcitation(request, &options);
  std::string file;
  std::vector<std::string> notices;
  Model model = OpenSimulated(request, catalogue, &file, &notices);
  ChangeModel(request, catalogue, file, &model);
  ReadInputsOf(request, model, &options, &notices);
  for (const Finding& finding : ModelFindings(model, file)) {
    notices.push_back(BriefText(finding));
  }
  if (ready) ready(file);
  AddNotices(model, options, &notices);
  Run run = MakeRun(request, model, options, &notices);
  return {std::move(run), std::move(model), file, std::move(notices)};
}

}  // namespace sysid
