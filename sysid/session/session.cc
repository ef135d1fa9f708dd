#include "sysid/session/session.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>

#include "models/dynamics.h"
#include "models/error.h"
#include "models/find_model.h"
#include "models/urdf/load_urdf.h"
#include "sysid/io/csv.h"
#include "sysid/io/read_run.h"
#include "sysid/session/check_runs.h"
#include "sysid/session/named_values.h"
#include "sysid/session/session_options.h"

namespace sysid {
namespace {

std::string Number(double value) { return ShortestText(value); }

bool IsWhole(const Model& model, const Parameter& parameter) {
  return parameter.kind == ParameterKind::kEffect &&
         model.effects().parameters()[parameter.index].whole;
}

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

// That a specification's model, where it is a name, is there: FindModel would
// blame the flag.
void CheckShipped(const Located<std::string>& model) {
  try {
    FindModel(model.value);
  } catch (const InputError& error) {
    throw InputError(model.place,
                     "no shipped model is named '" + model.value + "'",
                     error.hint());
  }
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
  bool Has(const std::string& name) const {
    return std::any_of(list_.begin(), list_.end(),
                       [&](const auto& free) { return free.name == name; });
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

// Whether the motion depends on a parameter of the mechanism at all: a planar
// one never feels most of its links' inertia. Asked of the efforts of a motion
// that has no symmetry.
bool Moves(const Model& model, const Parameter& parameter) {
  Eigen::VectorXd x(model.state_size() + model.nv());
  for (int i = 0; i < x.size(); ++i) x[i] = std::sin(1.0 + 2.0 * i);
  for (const Body& body : model.bodies()) {
    if (body.type == JointType::kSpherical) {
      x.segment<4>(body.q_index).normalize();
    }
  }
  const auto efforts = [&](double value) {
    Model changed = model;
    SetParameters({parameter}, {value}, &changed);
    Workspace<double> ws(changed);
    Eigen::VectorXd tau(model.nv());
    InverseDynamics<double>(&ws, x.data(), x.data() + model.nq(),
                            x.data() + model.state_size(), tau.data());
    return tau;
  };
  const Eigen::VectorXd there = efforts(parameter.nominal);
  const Eigen::VectorXd beside =
      efforts(parameter.nominal + parameter.typical_scale);
  return (beside - there).norm() > 1e-9 * (beside.norm() + there.norm());
}

// Frees what an effect says is wrong in the nominal values, as far as it moves
// the model.
void FreeCorrected(const Effect& effect, const std::string& place,
                   const FitSpecification& spec, const Model& model,
                   FreeList* free, std::vector<std::string>* notices) {
  std::vector<std::string> idle;
  for (const std::string& name : effect.corrects()) {
    if (free->Has(name) ||
        Moves(model, FindParameters(model, {name}, place).front())) {
      free->Add(Described(spec, name, place));
    } else {
      idle.push_back(name);
    }
  }
  if (idle.empty()) return;
  if (idle.size() == effect.corrects().size()) {
    throw InputError(place,
                     "effect '" + effect.name() + "': the motion of this " +
                         "model does not depend on " + Join(idle),
                     "leave it out");
  }
  notices->push_back(effect.name() + ": the motion of this model does not " +
                     "depend on " + Join(idle) + ", held");
}

// Adds effects that were named in one place, and frees their parameters.
void AddEffects(const std::vector<Located<std::string>>& named,
                const Catalogue& catalogue, const FitSpecification& spec,
                Model* model, FreeList* free,
                std::vector<std::string>* notices) {
  const auto is_named = [&](const std::string& name) {
    return std::any_of(named.begin(), named.end(),
                       [&](const auto& other) { return other.value == name; });
  };
  for (const Located<std::string>& one : named) {
    const std::shared_ptr<const Effect> effect =
        catalogue.Make(one.value, model->mechanism(), one.place);
    // One that is there already (from the URDF or the specification) becomes
    // free.
    if (!model->effects().Contains(one.value)) {
      const std::vector<std::string> before = model->effects().names();
      model->AddEffect(effect, one.place);
      for (const std::string& name : before) {
        if (model->effects().Contains(name)) continue;
        if (is_named(name)) {
          throw InputError(one.place,
                           one.value + " shares parameters with " + name +
                               ", which is named beside it",
                           "leave one of them out");
        }
        notices->push_back(one.value + " takes the place of " + name);
      }
    }
    for (const EffectParameter& parameter : effect->parameters()) {
      if (parameter.whole) continue;
      free->Add(Described(spec, parameter.name, one.place));
    }
    FreeCorrected(*effect, one.place, spec, *model, free, notices);
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
    CheckValue(*model, found[0], *fix.value, fix.place);
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
  free.parameter = FindParameters(model, {wanted.name}, wanted.place).front();
  free.lower = std::max(free.parameter.lower,
                        wanted.lower.value_or(free.parameter.lower));
  free.upper = std::min(free.parameter.upper,
                        wanted.upper.value_or(free.parameter.upper));
  free.initial = wanted.initial.value_or(free.parameter.nominal);
  if (IsWhole(model, free.parameter)) {
    throw InputError(
        wanted.place,
        "'" + wanted.name + "' is a whole number, which a fit cannot move",
        "hold it: --fix " + wanted.name + "=" +
            Number(wanted.initial.value_or(6.0)));
  }
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
    throw InputError(wanted.place,
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
    throw InputError(
        wanted.front().place,
        "the initial values make link '" + link + "' no possible body",
        "masses are positive, principal moments are positive, and "
        "none exceeds the sum of the other two");
  }
}

std::vector<Run> ReadRuns(const std::vector<std::string>& files,
                          Session* session) {
  std::vector<Run> runs;
  std::vector<std::string>* notices = &session->notices;
  for (const std::string& file : files) {
    std::vector<std::string> own;
    runs.push_back(ReadSessionRun(*session, file, &own));
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

// A joint that one run drives and another does not: that may be so, or its
// efforts were not recorded.
void NoteUndriven(const std::vector<Run>& runs, const std::vector<Run>& holdout,
                  const Mechanism& mechanism,
                  std::vector<std::string>* notices) {
  std::vector<const Run*> all;
  for (const Run& run : runs) all.push_back(&run);
  for (const Run& run : holdout) all.push_back(&run);
  for (const Joint& joint : mechanism.joints) {
    const auto driven = [&](const Run* run) {
      return !run->effort.middleCols(joint.v_index, VelocitySize(joint.type))
                  .isZero(0.0);
    };
    if (std::none_of(all.begin(), all.end(), driven)) continue;
    for (const Run* run : all) {
      if (driven(run)) continue;
      notices->push_back(run->name + ": no effort acts on joint '" +
                         joint.name +
                         "', as it does in other runs: right only if it was "
                         "not driven there");
    }
  }
}

}  // namespace

void CheckValue(const Model& model, const Parameter& parameter, double value,
                const std::string& place) {
  const std::string cannot = "'" + parameter.name + "' cannot be " +
                             Number(value) + " " + parameter.unit;
  if (value < parameter.lower || value > parameter.upper) {
    throw InputError(place, cannot,
                     "it lies between " + Number(parameter.lower) + " and " +
                         Number(parameter.upper));
  }
  if (IsWhole(model, parameter) && value != std::round(value)) {
    throw InputError(place, cannot, "give a whole number");
  }
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

Run ReadSessionRun(const Session& session, const std::string& file,
                   std::vector<std::string>* notices) {
  const Mechanism& mechanism = session.model.mechanism();
  Run run = ReadRun(file, session.columns, mechanism, notices);
  ApplyEdits(session.edits, mechanism, &run, notices);
  return run;
}

namespace {

// All but the runs and what depends on them.
Session OpenWithoutRuns(const FitRequest& request, const FitSpecification& spec,
                        const Catalogue& catalogue) {
  const std::string wanted = !request.model.empty() ? request.model
                             : spec.model           ? spec.model->value
                                                    : "";
  if (wanted.empty()) {
    throw InputError(
        "--model", "is missing",
        "give a URDF file or a shipped model: " + Join(ShippedModels()));
  }
  if (request.traj.empty()) {
    throw InputError("--traj", "is missing",
                     "give the recordings to fit: --traj run1.csv,run2.csv");
  }
  CheckDistinct(request.traj, request.holdout);
  if (request.model.empty()) CheckShipped(*spec.model);
  std::string file;
  std::vector<std::string> notices;
  Model model = OpenModel(wanted, catalogue, &file, &notices);
  const bool was_singular = !SingularJoints(model).empty();

  FreeList free;
  if (!request.free.empty()) {
    for (const NamedValue& name : SplitAssignments(request.free, "--free")) {
      FitSpecification::Free described = Described(spec, name.name, "--free");
      if (name.value) {
        described.initial = name.value;
        described.place = "--free";
      }
      free.Add(described);
    }
  } else {
    for (const FitSpecification::Free& f : spec.free) free.Add(f);
  }
  AddEffects(spec.effects, catalogue, spec, &model, &free, &notices);
  std::vector<Located<std::string>> added;
  for (const NamedValue& effect : SplitAssignments(request.add, "--add")) {
    if (effect.value) {
      throw InputError("--add",
                       "'" + effect.name + "' has a value, which the fit finds",
                       "write --add " + effect.name);
    }
    added.push_back({effect.name, "--add"});
  }
  const std::vector<std::string> before = model.effects().names();
  const size_t free_before = free.list().size();
  AddEffects(added, catalogue, spec, &model, &free, &notices);
  std::set<std::string> freed_by_added;
  for (size_t i = free_before; i < free.list().size(); ++i) {
    freed_by_added.insert(free.list()[i].name);
  }
  std::vector<NamedValue> fixes;
  for (const FitSpecification::Fix& fix : spec.fix) {
    fixes.push_back({fix.name, fix.value, fix.place});
  }
  const std::vector<NamedValue> freed =
      SplitAssignments(request.free, "--free");
  for (const NamedValue& fix : SplitAssignments(request.fix, "--fix")) {
    for (const NamedValue& other : freed) {
      if (other.name != fix.name) continue;
      throw InputError("--fix", "'" + fix.name + "' is also in --free",
                       "keep it in one of them");
    }
    std::erase_if(fixes, [&](const auto& f) { return f.name == fix.name; });
    fixes.push_back(fix);
  }
  FixParameters(fixes, &model, &free);

  Session session(model);
  session.spec_file = spec.path;
  session.model_file = file;
  session.model_name = std::filesystem::path(file).stem().string();
  session.notices = notices;
  session.effects = model.effects().names();
  for (const NamedValue& fix : fixes) session.fixed.push_back(fix.name);
  session.freed_by_added = freed_by_added;
  for (const std::string& effect : session.effects) {
    if (std::find(before.begin(), before.end(), effect) == before.end()) {
      session.added.push_back(effect);
    }
  }
  std::vector<FitSpecification::Free> chosen = free.list();
  const bool deliberate = request.may_free_nothing && !spec.path.empty();
  if (chosen.empty() && !deliberate && !request.fits_nothing) {
    std::vector<std::string> names;
    for (const Parameter& parameter : AllParameters(model)) {
      names.push_back(parameter.name);
    }
    const bool fixed =
        !request.fix.empty() && (!spec.free.empty() || !request.add.empty());
    throw InputError(
        fixed               ? "--fix"
        : spec.path.empty() ? "--free"
                            : spec.path,
        fixed ? "holds all that was free, so there is nothing to "
                "fit"
              : "nothing is free, so there is nothing to fit",
        "name parameters with --free; this model has " + Join(names));
  }
  for (const FitSpecification::Free& f : chosen) {
    session.free.push_back(MakeFree(model, f));
  }
  CheckTransformed(model, &session.free, chosen);
  const std::vector<std::string> singular = SingularJoints(model);
  if (!singular.empty()) {
    throw InputError(
        was_singular || fixes.empty() ? file : fixes.front().place,
        Join(singular, "\n  "),
        "give what moves there some mass and inertia, however small");
  }

  session.solver = ChooseSolver(request, spec);
  FillOptions(request, spec, &session.options);
  session.flag_columns = ParseColumnMap(request.columns);
  session.columns = MergeColumnMaps(spec.columns, session.flag_columns);
  session.flag_edits = {ParseShifts(request.shift, "--shift"),
                        ParseIgnored(request.ignore, "--ignore")};
  session.edits = MergeEdits(spec.edits, session.flag_edits);
  CheckEdits(session.edits, model.mechanism());
  std::vector<std::string> files = request.traj;
  files.insert(files.end(), request.holdout.begin(), request.holdout.end());
  CheckRunNames(session.flag_columns, session.flag_edits, model.mechanism(),
                files);
  return session;
}

}  // namespace

Session OpenModelSession(const FitRequest& request,
                         const Catalogue& catalogue) {
  return OpenWithoutRuns(request, ReadSpecification(request), catalogue);
}

Session OpenSession(const FitRequest& request, const Catalogue& catalogue) {
  const FitSpecification spec = ReadSpecification(request);
  Session session = OpenWithoutRuns(request, spec, catalogue);
  session.runs = ReadRuns(request.traj, &session);
  session.holdout = ReadRuns(request.holdout, &session);
  CheckTimes(session.runs, session.columns, session.model.mechanism());
  CheckMotion(session.runs);
  CheckTimes(session.holdout, session.columns, session.model.mechanism());
  NoteUndriven(session.runs, session.holdout, session.model.mechanism(),
               &session.notices);
  FillLengths(request, spec, session.runs, &session.options, &session.notices);
  return session;
}

}  // namespace sysid
