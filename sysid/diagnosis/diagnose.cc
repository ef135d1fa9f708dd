#include "sysid/diagnosis/diagnose.h"

#include "sysid/diagnosis/diagnose_by_sets.h"
#include "sysid/diagnosis/search.h"

namespace sysid {

std::vector<std::string> Diagnosis::added() const {
  std::vector<std::string> names;
  for (const auto& effect : last().added) names.push_back(effect->name());
  return names;
}

Diagnosis Diagnose(const DiagnosisProblem& problem,
                   const std::vector<std::shared_ptr<const Effect>>& candidates,
                   const DiagnosisOptions& options) {
  if (options.by_sets) return DiagnoseBySets(problem, candidates, options);
  return Search(problem, candidates, options).Run();
}

}  // namespace sysid
