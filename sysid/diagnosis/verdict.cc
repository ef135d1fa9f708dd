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

Verdict Judge(const EvaluatedModel& evaluated, const CandidateRefit* best) {
  // An effect that explains less of the excess over the noise is not what is
  // missing.
  constexpr double kExplains = 0.2;
  if (best != nullptr) {
    const double holdout = evaluated.holdout_error();
    const double excess = holdout * holdout - 1.0;
    const double left = std::pow(best->after->holdout_error(), 2) - 1.0;
    if (IsAtNoiseFloor(*best->after) || excess - left > kExplains * excess) {
      return Verdict::kMissingEffect;
    }
  }
  return IsAtNoiseFloor(evaluated) ? Verdict::kAdequate : Verdict::kUnexplained;
}

bool ExplainsMost(const DiagnosisProblem& problem, const EvaluatedModel& given,
                  const EvaluatedModel& found) {
  constexpr double kMost = 0.75;  // of the excess: half of the error
  const double before = given.cv.error();
  const double after = EvaluateOver(problem, found, given).cv.error();
  return after * after - 1.0 < (1.0 - kMost) * (before * before - 1.0);
}

}  // namespace sysid
