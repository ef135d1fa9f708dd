#include "sysid/diagnosis/verdict.h"

#include <cmath>

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

bool ExplainsEnough(double before, double after) {
  constexpr double kExplains = 0.2;
  return before * before - after * after > kExplains * (before * before - 1.0);
}

Verdict Judge(const EvaluatedModel& evaluated, const CandidateRefit* best) {
  if (best != nullptr && (IsAtNoiseFloor(*best->after) ||
                          ExplainsEnough(evaluated.holdout_error(),
                                         best->after->holdout_error()))) {
    return Verdict::kMissingEffect;
  }
  return IsAtNoiseFloor(evaluated) ? Verdict::kAdequate : Verdict::kUnexplained;
}

bool ExplainsMost(const DiagnosisProblem& problem, const EvaluatedModel& given,
                  const EvaluatedModel& found) {
  constexpr double kMost = 0.75;  // of the excess: half of the error
  const bool longer = found.fit.segment_s > given.fit.segment_s;
  const double before =
      (longer ? EvaluateOver(problem, given, found) : given).cv.error();
  const double after =
      (longer ? found : EvaluateOver(problem, found, given)).cv.error();
  return after * after - 1.0 < (1.0 - kMost) * (before * before - 1.0);
}

}  // namespace sysid
