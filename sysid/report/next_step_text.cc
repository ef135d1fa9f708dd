#include <algorithm>
#include <string>
#include <vector>

#include "models/error.h"
#include "sysid/io/csv.h"
#include "sysid/report/diagnosis_report.h"
#include "sysid/report/text.h"

namespace sysid {

std::string AddText(const NextStep& step) { return Join(step.add, ","); }

std::string FixText(const NextStep& step) {
  std::vector<std::string> fix;
  for (const NamedValue& value : step.fix) {
    fix.push_back(value.value ? value.name + "=" + ShortestText(*value.value)
                              : value.name);
  }
  return Join(fix, ",");
}

std::string SolverText(const NextStep& step) {
  return step.solver.empty() ? "" : " --solver " + step.solver;
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
