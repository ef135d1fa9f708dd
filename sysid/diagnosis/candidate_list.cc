#include "sysid/diagnosis/candidate_list.h"

namespace sysid {

std::string ToldApartBy(const Effect& one, const Effect& other) {
  if (one.ShowsIn() == other.ShowsIn()) {
    return "they differ only in how they grow over " + one.ShowsIn() +
           ": the wider its range, the better";
  }
  return one.name() + " is identified by " + one.ShowsIn() + "; " +
         other.name() + " by " + other.ShowsIn();
}

std::vector<ParameterEstimate> EstimatesOf(
    const EvaluatedModel& evaluated,
    const std::vector<const Effect*>& effects) {
  std::vector<ParameterEstimate> estimates;
  for (const Effect* effect : effects) {
    for (const std::string& name : effect->ParameterNames()) {
      for (const ParameterEstimate& p : evaluated.fit.parameters) {
        if (p.name == name) estimates.push_back(p);
      }
    }
  }
  return estimates;
}

}  // namespace sysid
