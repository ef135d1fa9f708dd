#include <algorithm>
#include <string>
#include <vector>

#include "models/error.h"
#include "sysid/report/diagnosis_report.h"
#include "sysid/report/text.h"

namespace sysid {

NextStep ChooseNext(const Session& session, const Diagnosis& diagnosis) {
  std::vector<std::string> add, fix = session.assumed;
  // What does not explain the data is not recommended.
  if (diagnosis.verdict == Verdict::kUnexplained) {
    return {"", Join(fix, ","), ""};
  }
  for (const auto& effect : diagnosis.last().added) {
    add.push_back(effect->name());
    for (const std::string& name : effect->ParameterNames()) {
      if (diagnosis.last().without_influence.count(name) > 0) {
        fix.push_back(name);
      }
    }
    // What was searched among whole numbers stays as it was found.
    for (const EffectParameter& parameter : effect->parameters()) {
      if (!parameter.whole) continue;
      const Model& model = diagnosis.last().fit.model;
      for (size_t i = 0; i < model.effects().parameters().size(); ++i) {
        if (model.effects().parameters()[i].name == parameter.name) {
          fix.push_back(parameter.name +
                        Format("=%g", model.nominal().effects[i]));
        }
      }
    }
  }
  if (diagnosis.steps.empty()) {
    add = diagnosis.proposed;
    for (size_t i = 0; i < add.size(); ++i) {
      const auto& idle = diagnosis.candidates[i].screened.without_influence;
      fix.insert(fix.end(), idle.begin(), idle.end());
    }
  }
  return {Join(add, ","), Join(fix, ","),
          diagnosis.by_equations ? " --solver inverse_dynamics" : ""};
}

std::string ExperimentWords(const NextExperiment& experiment) {
  if (!experiment.why_none.empty()) return experiment.why_none;
  std::string words = Format(
      "if one of the rivals is right, this motion shows which, with a "
      "probability of %.2g",
      std::min(experiment.probability, 0.99));
  if (!experiment.one_fits) {
    words += " (none reaches the noise: what else is missing may mislead)";
  }
  for (const std::vector<std::string>& group : experiment.alike) {
    words += "; " + Join(group, ", ") + " look alike in all such motions";
  }
  return words +
         ". Record it (the file has its start, and its efforts where there are "
         "any), and diagnose the old and the new recording together";
}

}  // namespace sysid
