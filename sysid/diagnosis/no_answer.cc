#include "sysid/diagnosis/no_answer.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "glog/logging.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/diagnosis/longer_segments.h"
#include "sysid/unexplained_force/discrepancy.h"

namespace sysid {

std::string WhyImplausible(const EvaluatedModel& evaluated,
                           const Effect& effect) {
  std::vector<std::string> names;
  for (const EffectParameter& own : effect.parameters()) {
    names.push_back(own.name);
  }
  std::vector<double> values;
  for (const Parameter& own :
       FindParameters(evaluated.fit.model, names, effect.name())) {
    values.push_back(own.nominal);
  }
  const std::string why = effect.Implausible(values);
  return why.empty() ? "" : effect.name() + ": " + why;
}

std::string LikeliestChance(const DiagnosisProblem& problem,
                            const EvaluatedModel& evaluated,
                            size_t candidates) {
  const ShootingProblem all = WithAllRuns(problem, evaluated);
  const std::optional<Fit> whole = FitWholeRuns(all, evaluated);
  Fit fit = whole ? *whole : evaluated.fit;
  if (whole) {
    AddDiscrepancy(all, &fit);
  } else {
    AddDiscrepancy(*evaluated.problem, &fit);
  }
  std::string likeliest;
  double most = kByChance;
  // Each could be any of those that are not in the model.
  const size_t tests =
      candidates - std::min(candidates, evaluated.added.size()) + 1;
  for (const auto& effect : evaluated.added) {
    const double p = tests * PValueOf(*effect, problem.model, fit);
    VLOG(1) << effect->name() << ": could be chance by " << p
            << (whole ? ", of whole runs" : ", of segments") << ", among "
            << tests;
    if (p > most) {
      most = p;
      likeliest = effect->name();
    }
  }
  return likeliest;
}

}  // namespace sysid
