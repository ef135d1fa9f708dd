#include "sysid/api/next_step.h"

#include "sysid/session/named_values.h"

namespace sysid {
namespace {

// The whole numbers among an effect's parameters, which a search found, as they
// are in the model.
std::vector<NamedValue> WholeNumbers(const Effect& effect, const Model& model) {
  std::vector<NamedValue> values;
  const std::vector<EffectParameter>& of_model = model.effects().parameters();
  for (const EffectParameter& parameter : effect.parameters()) {
    if (!parameter.whole) continue;
    for (size_t i = 0; i < of_model.size(); ++i) {
      if (of_model[i].name != parameter.name) continue;
      values.push_back({parameter.name, model.nominal().effects[i]});
    }
  }
  return values;
}

}  // namespace

NextStep ChooseNext(const Session& session, const Diagnosis& diagnosis) {
  NextStep step;
  for (const std::string& assumed : session.assumed) {
    step.fix.push_back(SplitAssignments(assumed, "--fix").front());
  }
  // What does not explain the data is not recommended.
  if (diagnosis.verdict == Verdict::kUnexplained) return step;
  const EvaluatedModel& last = diagnosis.last();
  for (const auto& effect : last.added) {
    step.add.push_back(effect->name());
    for (const std::string& name : effect->ParameterNames()) {
      if (last.without_influence.count(name) > 0) step.fix.push_back({name});
    }
    for (NamedValue& value : WholeNumbers(*effect, last.fit.model)) {
      step.fix.push_back(std::move(value));
    }
  }
  if (diagnosis.steps.empty()) {
    step.add = diagnosis.proposed;
    for (size_t i = 0; i < step.add.size(); ++i) {
      for (const std::string& name :
           diagnosis.candidates[i].screened.without_influence) {
        step.fix.push_back({name});
      }
    }
  }
  if (diagnosis.by_equations) step.solver = "inverse_dynamics";
  return step;
}

FitRequest WithStep(FitRequest request, const NextStep& step) {
  request.add.insert(request.add.end(), step.add.begin(), step.add.end());
  request.fix.insert(request.fix.end(), step.fix.begin(), step.fix.end());
  if (!step.solver.empty()) request.solver = step.solver;
  return request;
}

}  // namespace sysid
