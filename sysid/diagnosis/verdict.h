#pragma once

#include <string>

#include "sysid/diagnosis/evaluated_model.h"

namespace sysid {

enum class Verdict {
  kAdequate,
  kMissingEffect,
  kUndecided,  // which of several effects is missing (Diagnosis::rivals)
  kUnexplained
};
std::string ToString(Verdict verdict);  // as diagnosis.json says it

// Whether the found model accounts for most of what the given one misses of
// unseen data: (7.14), of errors over the same stretches, that of the found
// model lowered by so many standard errors of their ratio. Else what is missing
// is something that no candidate is, and each stands in for a part of it.
bool ExplainsMost(const CrossValidation& before, const CrossValidation& after,
                  double deviations = 0.0);
// Of two models over the same segments.
bool ExplainsMost(const DiagnosisProblem& problem, const EvaluatedModel& given,
                  const EvaluatedModel& found, double deviations = 0.0);

// Of estimates by the equations of motion: of the mean square of the joints'
// efforts, each by what the given model leaves of it, on the average over
// joints.
bool ExplainsMostEffort(const Fit& given, const Fit& found);

}  // namespace sysid
