#include "sysid/session/session.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>
#include <thread>

#include "models/error.h"
#include "models/find_model.h"
#include "models/urdf/load_urdf.h"
#include "sysid/io/csv.h"
#include "sysid/io/read_run.h"

namespace sysid {
namespace {

std::string Number(double value) { return ShortestText(value); }

// The specification of --spec, or the one beside the model.
FitSpecification ReadSpecification(const FitRequest& request) {
  if (!request.spec.empty()) return ReadFitSpecification(request.spec);
  if (request.model.empty()) return {};
  const std::filesystem::path urdf = FindModel(request.model);
  std::filesystem::path beside = urdf;
  beside.replace_extension(".sysid.yaml");
  if (!std::filesystem::exists(beside)) return {};
  return ReadFitSpecification(beside.string());
}

// Collects what is to be free, by name, in order, once each.
class FreeList {
 public:
  void Add(const FitSpecification::Free& free) {
    for (FitSpecification::Free& known : list_) {
      if (known.name == free.name) return;
    }
    list_.push_back(free);
  }
  void Remove(const std::string& name) {
    std::erase_if(list_, [&](const auto& free) { return free.name == name; });
  }
  const std::vector<FitSpecification::Free>& list() const { return list_; }

 private:
  std::vector<FitSpecification::Free> list_;
};

// What the specification says of a parameter (bounds, start, prior), or just
// its name.
FitSpecification::Free Described(const FitSpecification& spec,
                                 const std::string& name,
                                 const std::string& place) {
  for (const FitSpecification::Free& free : spec.free) {
    if (free.name == name) return free;
  }
  FitSpecification::Free free;
  free.name = name;
  free.place = place;
  return free;
}

void AddEffect(const std::string& name, const std::string& place,
               const Catalogue& catalogue, Model* model, FreeList* free,
               const FitSpecification& spec) {
  const std::shared_ptr<const Effect> effect =
      catalogue.Make(name, model->mechanism(), place);
  // One that is there already (from the URDF or the specification) becomes
  // free.
  if (!model->effects().Contains(name)) model->AddEffect(effect);
  for (const EffectParameter& parameter : effect->parameters()) {
    free->Add(Described(spec, parameter.name, place));
  }
}

void FixParameters(const std::vector<NamedValue>& fixes, Model* model,
                   FreeList* free) {
  std::vector<std::string> names;
  std::vector<double> values;
  for (const NamedValue& fix : fixes) {
    const std::vector<Parameter> found =
        FindParameters(*model, {fix.name}, fix.place);
    free->Remove(fix.name);
    if (!fix.value) continue;
    if (*fix.value < found[0].lower || *fix.value > found[0].upper) {
      throw InputError(fix.place,
                       "'" + fix.name + "' cannot be " + Number(*fix.value) +
                           " " + found[0].unit,
                       "it lies between " + Number(found[0].lower) + " and " +
                           Number(found[0].upper));
    }
    names.push_back(fix.name);
    values.push_back(*fix.value);
  }
  if (names.empty()) return;
  SetParameters(FindParameters(*model, names, fixes.front().place), values,
                model);
  const std::vector<std::string> faults = [&] {
    Mechanism changed = model->mechanism();
    changed.nominal = model->nominal();
    return PhysicalFaults(changed);
  }();
  if (!faults.empty()) {
    throw InputError(fixes.front().place,
                     "the values make no possible body: " + Join(faults, "; "));
  }
}

FreeParameter MakeFree(const Model& model,
                       const FitSpecification::Free& wanted) {
  FreeParameter free;
  free.parameter =
      FindParameters(model, {wanted.name}, wanted.place).front();
  free.lower = std::max(free.parameter.lower,
                        wanted.lower.value_or(free.parameter.lower));
  free.upper = std::min(free.parameter.upper,
                        wanted.upper.value_or(free.parameter.upper));
  free.initial = wanted.initial.value_or(free.parameter.nominal);
  const std::string range = "[" + Number(free.lower) + ", " +
                            Number(free.upper) + "] " + free.parameter.unit;
  if (!(free.lower < free.upper)) {
    throw InputError(wanted.place,
                     "the bounds of '" + wanted.name +
                         "' leave nothing between them: " + range,
                     "its physical range is " + Number(free.parameter.lower) +
                         " to " + Number(free.parameter.upper));
  }
  if (free.initial < free.lower || free.initial > free.upper) {
    throw InputError(
        wanted.place,
        "'" + wanted.name + "' starts at " + Number(free.initial) +
            " outside its bounds " + range,
        "widen the bounds, or give an initial value between them");
  }
  if (wanted.prior) {
    free.prior = FreeParameter::Prior{wanted.prior->mean, wanted.prior->std};
  }
  return free;
}

// Bounds and priors act on theta, which is not the inertia itself where (4.1)
// keeps it possible.
void CheckTransformed(const Model& model, std::vector<FreeParameter>* free,
                      const std::vector<FitSpecification::Free>& wanted) {
  std::vector<Parameter> parameters;
  for (const FreeParameter& f : *free) parameters.push_back(f.parameter);
  const ParameterMap map(model, parameters);
  Eigen::VectorXd values(free->size()), theta;
  for (size_t i = 0; i < free->size(); ++i) {
    values[i] = (*free)[i].initial;
    if (!map.IsTransformed(i)) continue;
    if (wanted[i].lower || wanted[i].upper || wanted[i].prior) {
      throw InputError(
          wanted[i].place,
          "'" + wanted[i].name +
              "' can have neither bounds nor a prior while all entries of its "
              "link's inertia are free",
          "they are kept physically possible together; free inertia_scale "
          "instead to bound them");
    }
    (*free)[i].lower = -std::numeric_limits<double>::infinity();
    (*free)[i].upper = std::numeric_limits<double>::infinity();
  }
  std::string link;
  if (!map.ThetaOf(values, &theta)) {
    throw InputError(wanted.front().place,
                     "the initial inertia is no possible body",
                     "principal moments are positive, and none exceeds the "
                     "sum of the other two");
  }
  if (!(link = map.FirstImpossibleLink(theta.data())).empty()) {
    throw InputError(wanted.front().place,
                     "the initial values make link '" + link +
                         "' no possible body",
                     "masses are positive, principal moments are positive, and "
                     "none exceeds the sum of the other two");
  }
}

void FillOptions(const FitRequest& request, const FitSpecification& spec,
                 EstimationOptions* options) {
  const auto number = [](const std::optional<double>& flag,
                         const std::optional<Located<double>>& file,
                         const std::string& name) {
    if (flag && !(*flag > 0 && std::isfinite(*flag))) {
      throw InputError("--" + name, "must be a positive number, not " +
                                        Number(*flag));
    }
    return flag ? *flag : file ? file->value : 0.0;
  };
  const auto word = [](const std::string& flag,
                       const std::optional<Located<std::string>>& file,
                       const std::string& name,
                       const std::vector<std::string>& known) {
    const std::string value = !flag.empty() ? flag : file ? file->value : "";
    if (!value.empty() &&
        std::find(known.begin(), known.end(), value) == known.end()) {
      throw InputError("--" + name, "unknown " + name + " '" + value + "'",
                       NameHint(value, known));
    }
    return value;
  };
  options->rollout.step = number(request.step, spec.step, "step");
  options->segment = number(request.segment, spec.segment, "segment");
  options->noise = number(request.noise, spec.noise, "noise");
  const std::string integrator = word(request.integrator, spec.integrator,
                                      "integrator", IntegratorNames());
  if (!integrator.empty()) {
    options->rollout.integrator = ParseIntegrator(integrator, "--integrator");
  }
  if (word(request.residual, spec.residual, "residual", ResidualNames()) ==
      "rotation") {
    options->orientation = OrientationResidual::kRotation;
  }
  const std::string loss =
      word(request.loss,
           spec.loss ? std::optional<Located<std::string>>(
                           {spec.loss->value.name, spec.loss->place})
                     : std::nullopt,
           "loss", LossNames());
  if (loss == "huber") options->loss = RobustLoss::kHuber;
  if (loss == "cauchy") options->loss = RobustLoss::kCauchy;
  if (spec.loss && spec.loss->value.scale) {
    options->loss_scale = *spec.loss->value.scale;
  }
  if (request.threads < 0) {
    throw InputError("--threads", "must not be negative",
                     "0 means all cores");
  }
  options->threads =
      request.threads > 0
          ? request.threads
          : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

std::vector<Run> ReadRuns(const std::vector<std::string>& files,
                          const ColumnMap& columns, const Mechanism& mechanism,
                          std::vector<std::string>* notices) {
  std::vector<Run> runs;
  for (const std::string& file : files) {
    std::vector<std::string> own;
    runs.push_back(ReadRun(file, columns, mechanism, &own));
    // What was said of one run is not said again of the next.
    for (const std::string& notice : own) {
      if (std::find(notices->begin(), notices->end(), notice) ==
          notices->end()) {
        notices->push_back(notice);
      }
    }
  }
  return runs;
}

void CheckLengths(const std::vector<Run>& runs, double segment) {
  constexpr int kFewest = 5;  // samples: fewer say nothing beyond the state
  for (const Run& run : runs) {
    const double duration = run.t.back() - run.t.front();
    if (run.size() < kFewest) {
      throw InputError(run.name,
                       "has " + std::to_string(run.size()) +
                           " samples: too few to fit anything",
                       "at least " + std::to_string(kFewest) + " are needed");
    }
    if (segment > duration * (1 + 1e-9)) {
      throw InputError("--segment",
                       Number(segment) + " s is longer than the run " +
                           run.name + " of " + Number(duration) + " s",
                       "leave --segment out, or give at most " +
                           Number(duration));
    }
  }
}

}  // namespace

std::vector<std::string> SplitList(const std::string& text,
                                   const std::string& place) {
  std::vector<std::string> parts;
  if (Trim(text).empty()) return parts;
  size_t from = 0;
  while (true) {
    const size_t comma = text.find(',', from);
    const std::string part(Trim(std::string_view(text).substr(
        from, comma == std::string::npos ? comma : comma - from)));
    if (part.empty()) {
      throw InputError(place, "has an empty entry: '" + text + "'",
                       "separate entries by single commas");
    }
    parts.push_back(part);
    if (comma == std::string::npos) return parts;
    from = comma + 1;
  }
}

std::vector<NamedValue> SplitAssignments(const std::string& text,
                                         const std::string& place) {
  std::vector<NamedValue> result;
  for (const std::string& part : SplitList(text, place)) {
    const size_t equals = part.find('=');
    NamedValue value{std::string(Trim(part.substr(0, equals))), {}, place};
    if (equals != std::string::npos) {
      double number = 0.0;
      const std::string written = part.substr(equals + 1);
      if (!ParseNumber(Trim(written), &number) || !std::isfinite(number)) {
        throw InputError(place,
                         "'" + written + "' is not a number, in '" + part + "'",
                         "write name=number, in SI units");
      }
      value.value = number;
    }
    result.push_back(value);
  }
  return result;
}

Model OpenModel(const std::string& name_or_file, const Catalogue& catalogue,
                std::string* file, std::vector<std::string>* notices) {
  *file = FindModel(name_or_file);
  const Mechanism mechanism = LoadUrdf(*file);
  Model model = MakeModel(mechanism, catalogue);
  for (const Joint& joint : mechanism.joints) {
    if (joint.damping != 0.0) {
      notices->push_back("joint '" + joint.name + "': <dynamics> damping " +
                         Number(joint.damping) +
                         " is in the model as viscous_damping");
    }
    if (joint.friction != 0.0) {
      notices->push_back("joint '" + joint.name + "': <dynamics> friction " +
                         Number(joint.friction) +
                         " is in the model as coulomb_friction");
    }
  }
  return model;
}

Session OpenSession(const FitRequest& request, const Catalogue& catalogue) {
  const FitSpecification spec = ReadSpecification(request);
  const std::string wanted = !request.model.empty() ? request.model
                             : spec.model           ? spec.model->value
                                                    : "";
  if (wanted.empty()) {
    throw InputError("--model", "is missing",
                     "give a URDF file or a shipped model: " +
                         Join(ShippedModels()));
  }
  if (request.traj.empty()) {
    throw InputError("--traj", "is missing",
                     "give the recordings to fit: --traj run1.csv,run2.csv");
  }
  std::string file;
  std::vector<std::string> notices;
  Model model = OpenModel(wanted, catalogue, &file, &notices);

  FreeList free;
  if (!request.free.empty()) {
    for (const NamedValue& name : SplitAssignments(request.free, "--free")) {
      FitSpecification::Free described =
          Described(spec, name.name, "--free");
      if (name.value) described.initial = name.value;
      free.Add(described);
    }
  } else {
    for (const FitSpecification::Free& f : spec.free) free.Add(f);
  }
  for (const Located<std::string>& effect : spec.effects) {
    AddEffect(effect.value, effect.place, catalogue, &model, &free, spec);
  }
  for (const std::string& effect : SplitList(request.add, "--add")) {
    AddEffect(effect, "--add", catalogue, &model, &free, spec);
  }
  std::vector<NamedValue> fixes;
  for (const FitSpecification::Fix& fix : spec.fix) {
    fixes.push_back({fix.name, fix.value, fix.place});
  }
  for (const NamedValue& fix : SplitAssignments(request.fix, "--fix")) {
    std::erase_if(fixes, [&](const auto& f) { return f.name == fix.name; });
    fixes.push_back(fix);
  }
  FixParameters(fixes, &model, &free);

  Session session(model);
  session.model_file = file;
  session.model_name = std::filesystem::path(file).stem().string();
  session.notices = notices;
  session.effects = model.effects().names();
  std::vector<FitSpecification::Free> chosen = free.list();
  if (chosen.empty()) {
    std::vector<std::string> names;
    for (const Parameter& parameter : AllParameters(model)) {
      names.push_back(parameter.name);
    }
    throw InputError(spec.path.empty() ? "--free" : spec.path,
                     "nothing is free, so there is nothing to fit",
                     "name parameters with --free; this model has " +
                         Join(names));
  }
  for (const FitSpecification::Free& f : chosen) {
    session.free.push_back(MakeFree(model, f));
  }
  CheckTransformed(model, &session.free, chosen);
  const std::vector<std::string> singular = SingularJoints(model);
  if (!singular.empty()) throw InputError(file, Join(singular, "\n  "));

  FillOptions(request, spec, &session.options);
  const ColumnMap columns = MergeColumnMaps(
      spec.columns, ParseColumnMap(request.columns));
  session.runs = ReadRuns(request.traj, columns, model.mechanism(),
                          &session.notices);
  session.holdout = ReadRuns(request.holdout, columns, model.mechanism(),
                             &session.notices);
  CheckLengths(session.runs, session.options.segment);
  CheckLengths(session.holdout, 0.0);
  return session;
}

}  // namespace sysid
