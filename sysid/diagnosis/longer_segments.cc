#include "sysid/diagnosis/longer_segments.h"

#include <algorithm>
#include <cmath>

#include "sysid/diagnosis/candidate_refits.h"

namespace sysid {

std::optional<EvaluatedModel> Lengthen(const DiagnosisProblem& problem,
                                       const EvaluatedModel& now,
                                       const ReportDoing& report) {
  // What a constant force is missed by grows with the square of the time; more
  // is chaos, or a wrong minimum.
  constexpr double kGrowth = 4.0;
  const double length = now.fit.segment_s;
  const DataSet& data = now.problem->data();
  const double longest =
      std::min(data.LongestDuration(), data.TotalDuration() / kFewestSegments);
  if (problem.options.segment > 0 || !now.fit.converged ||
      length > 0.9 * longest) {
    return std::nullopt;
  }
  report("longer segments", now.train_error());
  EvaluatedModel longer =
      EvaluateLonger(problem, now, std::min(2.0 * length, longest));
  if (!longer.fit.converged || !std::isfinite(longer.cv.error()) ||
      longer.train_error() > kGrowth * now.train_error() ||
      longer.fit.segment_s < 1.1 * length) {
    return std::nullopt;
  }
  return longer;
}

std::optional<EvaluatedModel> FromWholeRuns(const DiagnosisProblem& problem,
                                            const EvaluatedModel& now,
                                            const ReportDoing& report) {
  constexpr double kMuch = 0.8;  // of the error
  if (IsAtNoiseFloor(now) || !HasBlindStates(now)) return std::nullopt;
  report("joined segments", now.train_error());
  EvaluatedModel joined = EvaluateJoined(problem, now);
  if (!joined.fit.converged ||
      !(joined.train_error() < kMuch * now.train_error()) ||
      !(joined.holdout_error() < now.holdout_error())) {
    return std::nullopt;
  }
  return joined;
}

}  // namespace sysid
