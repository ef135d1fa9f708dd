#include "sysid/diagnosis/verdict.h"

#include <cmath>

#include "sysid/diagnosis/comparison.h"
#include "sysid/diagnosis/judgement_constants.h"

namespace sysid {

std::string ToString(Verdict verdict) {
  switch (verdict) {
    case Verdict::kAdequate:
      return "adequate";
    case Verdict::kMissingEffect:
      return "missing_effect";
    case Verdict::kUndecided:
      return "undecided";
    case Verdict::kUnexplained:
      return "unexplained";
  }
  return "";
}

bool ExplainsMost(const CrossValidation& before, const CrossValidation& after,
                  double deviations) {
  if (!std::isfinite(after.error())) return false;
  if (!std::isfinite(before.error())) return true;
  // Of a single stretch the standard error is infinite.
  const double uncertain =
      deviations > 0.0
          ? deviations *
                DifferenceOf(after.LogErrors(), before.LogErrors()).std_error
          : 0.0;
  const double least = after.error() * std::exp(-uncertain);
  return least * least - 1.0 <
         (1.0 - kMost) * (before.error() * before.error() - 1.0);
}

bool ExplainsMost(const DiagnosisProblem& problem, const EvaluatedModel& given,
                  const EvaluatedModel& found, double deviations) {
  const bool longer = found.fit.segment_s > given.fit.segment_s;
  return ExplainsMost((longer ? EvaluateOver(problem, given, found) : given).cv,
                      (longer ? found : EvaluateOver(problem, found, given)).cv,
                      deviations);
}

bool ExplainsMostEffort(const Fit& given, const Fit& found) {
  if (given.effort.empty() || given.effort.size() != found.effort.size()) {
    return false;
  }
  double left = 0.0;
  for (size_t i = 0; i < given.effort.size(); ++i) {
    left += std::pow(found.effort[i].rms / given.effort[i].rms, 2);
  }
  return left < (1.0 - kMost) * static_cast<double>(given.effort.size());
}

}  // namespace sysid
