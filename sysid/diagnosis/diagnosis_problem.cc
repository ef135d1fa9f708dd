// What a search asks of the data: its runs, its model and what is free.

#include <algorithm>
#include <map>
#include <utility>

#include "sysid/diagnosis/evaluated_model.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/parameters/starts.h"

namespace sysid {

void DiagnosisProblem::SetRuns(std::vector<Run> train_runs,
                               std::vector<Run> holdout_runs) {
  train = MakeDataSet(model, std::move(train_runs), options);
  if (holdout_runs.empty()) {
    holdout = nullptr;
  } else {
    holdout = MakeDataSetLike(model, std::move(holdout_runs), options, *train);
  }
}

double DiagnosisProblem::LongestToJudge() const {
  const double held_out = holdout != nullptr ? holdout->TotalDuration() : 0.0;
  return std::min(train->LongestDuration(),
                  (train->TotalDuration() + held_out) / kFewestSegments);
}

DiagnosisProblem WithEffects(
    const DiagnosisProblem& problem,
    const std::vector<std::shared_ptr<const Effect>>& effects,
    const std::set<std::string>& without_influence,
    const std::map<std::string, double>& values) {
  DiagnosisProblem out = problem;
  out.free.clear();
  std::vector<std::string> names;
  for (const FreeParameter& free : problem.free) {
    names.push_back(free.parameter.name);
  }
  for (const auto& effect : effects) {
    out.model.AddEffect(effect);
    std::set<std::string> held = without_influence;
    for (const EffectParameter& parameter : effect->parameters()) {
      if (parameter.whole) held.insert(parameter.name);
      const auto at = values.find(parameter.name);
      if (held.count(parameter.name) > 0 && at != values.end()) {
        out.model.SetEffectParameter(parameter.name, at->second);
      }
    }
    for (const std::string& name : effect->ParameterNames()) {
      if (held.count(name) == 0 &&
          std::find(names.begin(), names.end(), name) == names.end()) {
        names.push_back(name);
      }
    }
  }
  std::vector<std::string> said;  // by the finding of the model's file
  StartPossible(names, {}, &out.model, &said);
  const std::vector<Parameter> parameters =
      FindParameters(out.model, names, "effects");
  for (size_t i = 0; i < names.size(); ++i) {
    FreeParameter free;
    if (i < problem.free.size()) {
      free = problem.free[i];
    } else {
      free.lower = parameters[i].lower;
      free.upper = parameters[i].upper;
      free.initial = parameters[i].nominal;
    }
    free.parameter = parameters[i];
    const auto at = values.find(names[i]);
    if (at != values.end()) {
      free.initial = std::clamp(at->second, free.lower, free.upper);
    }
    out.free.push_back(free);
  }
  return out;
}

}  // namespace sysid
