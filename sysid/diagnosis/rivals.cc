#include "sysid/diagnosis/rivals.h"

#include <algorithm>
#include <map>
#include <string>

namespace sysid {

void AddAlternatives(const std::string& effect,
                     const std::vector<std::string>& alternatives,
                     std::vector<DiagnosisStep>* steps) {
  for (auto step = steps->rbegin(); step != steps->rend(); ++step) {
    for (size_t k = 0; k < step->effects.size(); ++k) {
      if (step->effects[k] != effect) continue;
      std::vector<std::string>& known = step->indistinguishable_from[k];
      for (const std::string& name : alternatives) {
        if (std::find(known.begin(), known.end(), name) == known.end()) {
          known.push_back(name);
        }
      }
      return;
    }
  }
}

void FindRivals(const std::vector<std::shared_ptr<const Effect>>& candidates,
                Diagnosis* diagnosis) {
  const auto parameters = [&](const std::string& name) {
    for (const auto& effect : candidates) {
      if (effect->name() == name) return effect->ParameterNames().size();
    }
    return size_t{0};
  };
  std::map<std::string, std::vector<std::string>> alternatives;
  if (diagnosis->steps.empty() && !diagnosis->candidates.empty()) {
    const CandidateEffect& first = diagnosis->candidates.front();
    alternatives[first.screened.name()] = first.indistinguishable_from;
  }
  for (const DiagnosisStep& step : diagnosis->steps) {
    for (size_t k = 0; k < step.effects.size(); ++k) {
      alternatives[step.effects[k]] = step.indistinguishable_from[k];
    }
  }
  const std::vector<std::string> answer =
      diagnosis->steps.empty() ? diagnosis->proposed : diagnosis->added();
  for (size_t k = 0; k < answer.size(); ++k) {
    for (const std::string& other : alternatives[answer[k]]) {
      if (parameters(other) > parameters(answer[k])) continue;
      if (diagnosis->rivals.empty()) diagnosis->rivals.push_back(answer);
      diagnosis->rivals.push_back(answer);
      diagnosis->rivals.back()[k] = other;
    }
  }
  if (diagnosis->rivals.empty()) return;
  if (diagnosis->verdict == Verdict::kMissingEffect) {
    diagnosis->verdict = Verdict::kUndecided;
  }
}

}  // namespace sysid
