#include "sysid/diagnosis/rivals.h"

#include <algorithm>
#include <map>
#include <string>

namespace sysid {

void AddNames(const std::vector<std::string>& names,
              std::vector<std::string>* known) {
  for (const std::string& name : names) {
    if (std::find(known->begin(), known->end(), name) == known->end()) {
      known->push_back(name);
    }
  }
}

std::vector<std::string> AlternativesTo(
    const std::string& effect, const std::vector<DiagnosisStep>& steps) {
  std::vector<std::string> alternatives;
  for (const DiagnosisStep& step : steps) {
    for (size_t k = 0; k < step.effects.size(); ++k) {
      if (step.effects[k] == effect) {
        AddNames(step.indistinguishable_from[k], &alternatives);
      }
    }
  }
  return alternatives;
}

void AddAlternatives(const std::string& effect,
                     const std::vector<std::string>& alternatives,
                     std::vector<DiagnosisStep>* steps) {
  for (auto step = steps->rbegin(); step != steps->rend(); ++step) {
    for (size_t k = 0; k < step->effects.size(); ++k) {
      if (step->effects[k] != effect) continue;
      AddNames(alternatives, &step->indistinguishable_from[k]);
      return;
    }
  }
}

void RemoveAlternatives(const std::string& effect,
                        const std::vector<std::string>& told_apart,
                        std::vector<DiagnosisStep>* steps) {
  for (DiagnosisStep& step : *steps) {
    for (size_t k = 0; k < step.effects.size(); ++k) {
      if (step.effects[k] != effect) continue;
      std::erase_if(step.indistinguishable_from[k], [&](const auto& name) {
        return std::find(told_apart.begin(), told_apart.end(), name) !=
               told_apart.end();
      });
    }
  }
}

void FindRivals(const std::vector<std::shared_ptr<const Effect>>& candidates,
                Diagnosis* diagnosis) {
  const auto find = [&](const std::string& name) -> const Effect* {
    for (const auto& effect : candidates) {
      if (effect->name() == name) return effect.get();
    }
    return nullptr;
  };
  const auto parameters = [&](const std::string& name) {
    const Effect* effect = find(name);
    return effect == nullptr ? 0 : effect->ParameterNames().size();
  };
  // The list of candidates knows of this mechanism, but has one pair only.
  const auto told_apart_by = [&](const std::string& one,
                                 const std::string& other) -> std::string {
    for (const CandidateEffect& candidate : diagnosis->candidates) {
      if (candidate.screened.name() == one &&
          !candidate.indistinguishable_from.empty() &&
          candidate.indistinguishable_from.front() == other) {
        return candidate.told_apart_by;
      }
    }
    const Effect *a = find(one), *b = find(other);
    return a == nullptr || b == nullptr ? "" : ToldApartBy(*a, *b);
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
      if (diagnosis->rivals.empty()) {
        diagnosis->rivals.push_back(answer);
        diagnosis->told_apart_by.emplace_back();
      }
      diagnosis->rivals.push_back(answer);
      diagnosis->rivals.back()[k] = other;
      diagnosis->told_apart_by.push_back(told_apart_by(answer[k], other));
    }
  }
  if (diagnosis->rivals.empty()) return;
  if (diagnosis->verdict == Verdict::kMissingEffect) {
    diagnosis->verdict = Verdict::kUndecided;
  }
}

}  // namespace sysid
