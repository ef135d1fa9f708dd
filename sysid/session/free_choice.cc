#include "sysid/session/free_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "models/dynamics.h"
#include "models/error.h"
#include "models/physical.h"
#include "sysid/io/csv.h"
#include "sysid/parameters/patterns.h"
#include "sysid/parameters/starts.h"
#include "sysid/session/locks.h"
#include "sysid/session/named_values.h"
#include "sysid/session/table_range.h"

namespace sysid {
namespace {

bool IsWhole(const Model& model, const Parameter& parameter) {
  return parameter.kind == ParameterKind::kEffect &&
         model.effects().parameters()[parameter.index].whole;
}

// What is to be free, by name, in order, once each.
using FreeList = std::vector<FitSpecification::Free>;

bool Has(const FreeList& list, const std::string& name) {
  return std::any_of(list.begin(), list.end(),
                     [&](const auto& free) { return free.name == name; });
}

void Add(const FitSpecification::Free& free, FreeList* list) {
  if (!Has(*list, free.name)) list->push_back(free);
}

// What the specification says of a parameter (bounds, start, prior), or just
// its name.
FitSpecification::Free Described(const FreeList& spec_free,
                                 const std::string& name,
                                 const std::string& place) {
  for (const FitSpecification::Free& free : spec_free) {
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
  for (const Body& body : model.movers()) {
    if (body.type == JointType::kSpherical) {
      x.segment<4>(model.layout().q(body)).normalize();
    }
  }
  const auto efforts = [&](double value) {
    Model changed = model;
    SetParameters({parameter}, {value}, &changed);
    Workspace<double> ws(changed);
    Eigen::VectorXd tau(model.nv());
    InverseDynamics<double>(&ws, x.data() + model.layout().q(),
                            x.data() + model.layout().qd(),
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
void FreeAdjusted(const Effect& effect, const std::string& place,
                  const FreeList& spec_free, const Model& model, FreeList* free,
                  std::vector<std::string>* notices) {
  std::vector<std::string> without_influence;
  for (const std::string& name : effect.adjusts_nominal()) {
    if (Has(*free, name) ||
        Moves(model, FindParameters(model, {name}, place).front())) {
      Add(Described(spec_free, name, place), free);
    } else {
      without_influence.push_back(name);
    }
  }
  if (without_influence.empty()) return;
  if (without_influence.size() == effect.adjusts_nominal().size()) {
    throw InputError(place,
                     "effect '" + effect.name() + "': the motion of this " +
                         "model does not depend on " + Join(without_influence),
                     "leave it out");
  }
  notices->push_back(effect.name() + ": the motion of this model does not " +
                     "depend on " + Join(without_influence) + ", held");
}

// An effect that was asked for, and where.
struct AskedEffect {
  std::shared_ptr<const Effect> effect;
  std::string place;
};

// Adds effects that were named in one place.
std::vector<AskedEffect> AddEffects(
    const std::vector<Located<std::string>>& patterns,
    const Catalogue& catalogue, Model* model,
    std::vector<std::string>* notices) {
  const std::vector<Located<std::string>> named =
      ExpandPatterns(patterns, &Located<std::string>::value,
                     EffectVocabulary(catalogue, model->mechanism()));
  const auto is_named = [&](const std::string& name) {
    return std::any_of(named.begin(), named.end(),
                       [&](const auto& other) { return other.value == name; });
  };
  std::vector<AskedEffect> asked;
  for (const Located<std::string>& one : named) {
    asked.push_back(
        {catalogue.Make(one.value, model->mechanism(), one.place), one.place});
    // One that is there already (from the URDF or the specification) becomes
    // free.
    const std::string own = asked.back().effect->name();
    if (model->effects().Contains(own)) continue;
    const std::vector<std::string> before = model->effects().names();
    model->AddEffect(asked.back().effect, one.place);
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
  return asked;
}

// Frees the parameters of effects.
void FreeParametersOf(const std::vector<AskedEffect>& asked,
                      const FreeList& spec_free, const Model& model,
                      FreeList* free, std::vector<std::string>* notices) {
  for (const AskedEffect& one : asked) {
    for (const EffectParameter& parameter : one.effect->parameters()) {
      if (parameter.whole || IsGiven(parameter)) continue;
      Add(Described(spec_free, parameter.name, one.place), free);
    }
    FreeAdjusted(*one.effect, one.place, spec_free, model, free, notices);
  }
}

// The values that the specification starts parameters of effects from.
std::vector<NamedValue> InitialValuesOf(const std::vector<AskedEffect>& asked,
                                        const FreeList& spec_free) {
  std::vector<NamedValue> values;
  for (const AskedEffect& one : asked) {
    for (const EffectParameter& parameter : one.effect->parameters()) {
      const auto own = Described(spec_free, parameter.name, one.place);
      values.push_back({own.name, own.initial, own.place});
    }
  }
  return values;
}

// The value of the model; where the effect says that it is off there and shows
// nothing of itself, another.
double StartOf(const Model& model, const Parameter& parameter) {
  if (parameter.kind != ParameterKind::kEffect) return parameter.nominal;
  const EffectParameter& own = model.effects().parameters()[parameter.index];
  return own.start && parameter.nominal == own.null_value ? *own.start
                                                          : parameter.nominal;
}

FreeParameter MakeFree(const Model& model,
                       const FitSpecification::Free& wanted) {
  FreeParameter free;
  free.parameter = FindParameters(model, {wanted.name}, wanted.place).front();
  free.lower = std::max(free.parameter.lower,
                        wanted.lower.value_or(free.parameter.lower));
  free.upper = std::min(free.parameter.upper,
                        wanted.upper.value_or(free.parameter.upper));
  free.initial = wanted.initial.value_or(StartOf(model, free.parameter));
  if (IsWhole(model, free.parameter)) {
    throw InputError(
        wanted.place,
        "'" + wanted.name + "' is a whole number, which a fit cannot move",
        "hold it: --fix " + wanted.name + "=" +
            ShortestText(wanted.initial.value_or(6.0)));
  }
  const std::string range = "[" + ShortestText(free.lower) + ", " +
                            ShortestText(free.upper) + "] " +
                            free.parameter.unit;
  if (!(free.lower < free.upper)) {
    throw InputError(wanted.place,
                     "the bounds of '" + wanted.name +
                         "' leave nothing between them: " + range,
                     "its physical range is " +
                         ShortestText(free.parameter.lower) + " to " +
                         ShortestText(free.parameter.upper));
  }
  if (free.initial < free.lower || free.initial > free.upper) {
    throw InputError(wanted.place,
                     "'" + wanted.name + "' starts at " +
                         ShortestText(free.initial) + " outside its bounds " +
                         range,
                     "widen the bounds, or give an initial value between them");
  }
  free.prior = wanted.prior;
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
  if (!map.ThetaOf(values, &theta)) {
    throw InputError(wanted.front().place,
                     "the initial inertia is no possible body",
                     "principal moments are positive, and none exceeds the "
                     "sum of the other two");
  }
  const std::string link = map.FirstImpossibleLink(theta.data());
  if (!link.empty()) {
    throw InputError(
        wanted.front().place,
        "the initial values make link '" + link + "' no possible body",
        "masses are positive, principal moments are positive, and "
        "none exceeds the sum of the other two");
  }
}

// The effects of --add.
std::vector<AskedEffect> AddAsked(const FitRequest& request,
                                  const Catalogue& catalogue,
                                  Session* session) {
  std::vector<Located<std::string>> asked;
  for (const std::string& effect : request.add) {
    asked.push_back({effect, "--add"});
  }
  DropHeldEffects(session->model.mechanism(), &asked, &session->notices);
  const std::vector<std::string> before = session->model.effects().names();
  const std::vector<AskedEffect> added =
      AddEffects(asked, catalogue, &session->model, &session->notices);
  for (const std::string& effect : session->model.effects().names()) {
    if (std::find(before.begin(), before.end(), effect) == before.end()) {
      session->added.push_back(effect);
    }
  }
  return added;
}

// What is free and what is held, by name: groups and patterns are written out,
// for which the model has its effects.
class NamedChoice {
 public:
  NamedChoice(const FitRequest& request, const FitSpecification& spec,
              const Model& model)
      : vocabulary_(ParameterVocabulary(model)),
        frees_none_(request.free_none),
        flag_free_(EachOnce(request.free, "--free")),
        spec_fix_(spec.fix),
        flag_fix_(EachOnce(request.fix, "--fix")),
        spec_free_(ExpandPatterns(spec.free, &FitSpecification::Free::name,
                                  vocabulary_)) {
    for (const FitSpecification::Free& free : spec.free) {
      if (!IsPattern(free.name, vocabulary_)) spec_named_.insert(free.name);
    }
    for (const NamedValue& free : flag_free_) {
      if (!IsPattern(free.name, vocabulary_)) flag_named_.insert(free.name);
    }
  }

  bool FreesNone() const { return frees_none_; }
  const FreeList& spec_free() const { return spec_free_; }
  // What is free by --free, or else by the specification.
  FreeList Free() const {
    FreeList free;
    if (!ByFlag()) {
      for (const FitSpecification::Free& f : spec_free_) Add(f, &free);
    }
    for (const NamedValue& name :
         ExpandPatterns(flag_free_, &NamedValue::name, vocabulary_)) {
      FitSpecification::Free described =
          Described(spec_free_, name.name, "--free");
      if (name.value) {
        described.initial = name.value;
        described.place = "--free";
      }
      Add(described, &free);
    }
    return free;
  }

  // What the specification fixes, and --fix, which wins. A pattern does not
  // hold what is free by its name, unless that is the file's and it the flag's.
  std::vector<NamedValue> Fixes() const {
    std::vector<NamedValue> fixes;
    const std::set<std::string>& chosen = ByFlag() ? flag_named_ : spec_named_;
    for (const NamedValue& fix : Held(spec_fix_, chosen)) fixes.push_back(fix);
    for (const NamedValue& fix : flag_fix_) {
      if (flag_named_.count(fix.name) == 0) continue;
      throw InputError("--fix", "'" + fix.name + "' is also in --free",
                       "keep it in one of them");
    }
    for (const NamedValue& fix : Held(flag_fix_, flag_named_)) {
      std::erase_if(fixes, [&](const auto& f) { return f.name == fix.name; });
      fixes.push_back(fix);
    }
    return fixes;
  }

 private:
  bool ByFlag() const { return frees_none_ || !flag_free_.empty(); }

  std::vector<NamedValue> Held(const std::vector<NamedValue>& fix,
                               const std::set<std::string>& free) const {
    std::set<std::string> written;
    for (const NamedValue& f : fix) written.insert(f.name);
    std::vector<NamedValue> held =
        ExpandPatterns(fix, &NamedValue::name, vocabulary_);
    std::erase_if(held, [&](const NamedValue& f) {
      return free.count(f.name) > 0 && written.count(f.name) == 0;
    });
    return held;
  }

  Vocabulary vocabulary_;
  bool frees_none_;
  std::vector<NamedValue> flag_free_, spec_fix_, flag_fix_;
  FreeList spec_free_;
  std::set<std::string> spec_named_, flag_named_;  // free, written out
};

// Throws InputError where nothing is free and something must be.
void CheckSomethingIsFree(const FitRequest& request,
                          const FitSpecification& spec, const Model& model,
                          const FreeList& free) {
  if (!free.empty() || request.may_free_nothing) return;
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
      fixed ? "holds all that was free, so there is nothing to fit"
            : "nothing is free, so there is nothing to fit",
      "name parameters with --free; this model has " + Join(names));
}

}  // namespace

void CheckValue(const Model& model, const Parameter& parameter, double value,
                const std::string& place) {
  const std::string cannot = "'" + parameter.name + "' cannot be " +
                             ShortestText(value) + " " + parameter.unit;
  if (!(value >= parameter.lower && value <= parameter.upper)) {  // or NaN
    throw InputError(place, cannot,
                     "it lies between " + ShortestText(parameter.lower) +
                         " and " + ShortestText(parameter.upper));
  }
  if (IsWhole(model, parameter) && value != std::round(value)) {
    throw InputError(place, cannot, "give a whole number");
  }
}

std::string SetValues(const std::vector<NamedValue>& values, Model* model) {
  std::vector<std::string> names;
  std::vector<Parameter> parameters;
  std::vector<double> numbers;
  for (const NamedValue& named : values) {
    names.push_back(named.name);  // each once
    const Parameter parameter =
        FindParameters(*model, names, named.place).back();
    if (!named.value) continue;
    CheckValue(*model, parameter, *named.value, named.place);
    parameters.push_back(parameter);
    numbers.push_back(*named.value);
  }
  if (numbers.empty()) return "";
  const Mechanism& mechanism = model->mechanism();
  const auto before = PhysicalFaults(mechanism, model->nominal());
  SetParameters(parameters, numbers, model);
  // What the model's file says is a finding, not the values' fault.
  auto faults = PhysicalFaults(mechanism, model->nominal());
  std::erase_if(faults, [&](const PhysicalFault& fault) {
    return std::any_of(before.begin(), before.end(), [&](const auto& other) {
      return other.link == fault.link;
    });
  });
  return ToString(faults, mechanism);
}

void CheckJoints(const Model& model, const std::string& place) {
  const std::vector<SingularJoint> singular = SingularJoints(model);
  if (singular.empty()) return;
  std::vector<std::string> names, rotors;
  for (const SingularJoint& joint : singular) {
    names.push_back(model.mechanism().joints[joint.joint].name);
    rotors.push_back("armature@" + names.back());
  }
  const bool one = names.size() == 1;
  throw InputError(place, Join(TextsOf(singular), "\n  "),
                   "give what moves there some mass and inertia, however "
                   "small, " +
                       std::string(one ? "a rotor" : "rotors") + " (--add " +
                       Join(rotors, ",") + "), or hold " +
                       (one ? "it" : "them") + " still: --lock '" +
                       Join(names, ",") + "'");
}

void ChooseFree(const FitRequest& request, const FitSpecification& spec,
                const Catalogue& catalogue, Session* session) {
  Model* const model = &session->model;
  const bool was_singular = !SingularJoints(*model).empty();
  const std::vector<AskedEffect> of_file =
      AddEffects(spec.effects, catalogue, model, &session->notices);
  const std::vector<AskedEffect> added = AddAsked(request, catalogue, session);
  session->effects = model->effects().names();
  const NamedChoice named(request, spec, *model);
  FreeList free = named.Free();
  const FreeList& spec_free = named.spec_free();
  if (named.FreesNone()) {  // but what --add names
    SetValues(InitialValuesOf(of_file, spec_free), model);
  } else {
    FreeParametersOf(of_file, spec_free, *model, &free, &session->notices);
  }
  const size_t free_before = free.size();
  FreeParametersOf(added, spec_free, *model, &free, &session->notices);
  for (size_t i = free_before; i < free.size(); ++i) {
    session->freed_by_added.insert(free[i].name);
  }
  const std::vector<NamedValue> fixes = named.Fixes();
  const std::string faults = SetValues(fixes, model);
  if (!faults.empty()) {
    throw InputError(fixes.front().place,
                     "the values make no possible body: " + faults);
  }
  for (const NamedValue& fix : fixes) {
    session->fixed.push_back(fix.name);
    std::erase_if(free, [&](const auto& f) { return f.name == fix.name; });
  }
  CheckSomethingIsFree(request, spec, *model, free);
  std::vector<std::string> names;
  std::vector<bool> given;
  for (const FitSpecification::Free& f : free) {
    FindParameters(*model, {f.name}, f.place);
    names.push_back(f.name);
    given.push_back(f.initial.has_value());
  }
  StartPossible(names, session->fixed, model, &session->notices);
  for (const FitSpecification::Free& f : free) {
    session->free.push_back(MakeFree(*model, f));
  }
  CheckTransformed(*model, &session->free, free);
  Model start = StartRegular(*model, given, &session->free, &session->notices);
  if (request.assumes_inertia) {
    start = AssumeInertia(session->free, model, &session->assumed,
                          &session->notices);
  }
  CheckJoints(start, fixes.empty() || was_singular ? session->model_file
                                                   : fixes.front().place);
}

}  // namespace sysid
