#include "sysid/diagnosis/longer_segments.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "models/math/constants.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/estimation/run_parts.h"
#include "sysid/estimation/segmentation.h"

namespace sysid {
namespace {

// The options of a model, to be fitted to the end, and silently.
EstimationOptions QuietOptions(const DiagnosisProblem& problem,
                               const EvaluatedModel& evaluated) {
  EstimationOptions quiet = evaluated.problem->options();
  quiet.progress = nullptr;
  // Those of a trial end early, and on a part of the threads.
  quiet.max_iterations = problem.options.max_iterations;
  quiet.least_gain = problem.options.least_gain;
  quiet.threads = problem.options.threads;
  return quiet;
}

}  // namespace

bool IsAsLong(double segment_s, double length) {
  constexpr double kAsLong = 0.9;  // some samples less
  return segment_s > kAsLong * length;
}

bool Follows(const EvaluatedModel& evaluated) {
  // (8.2) is NaN where nothing moves.
  return evaluated.fit.converged && std::isfinite(evaluated.cv.error()) &&
         (IsAtNoiseFloor(evaluated) ||
          !(evaluated.fit.train.total.fit_percent < kFollows));
}

std::optional<EvaluatedModel> Lengthen(const DiagnosisProblem& problem,
                                       const EvaluatedModel& now,
                                       const ReportDoing& report) {
  // What a constant force is missed by grows with the square of the time; more
  // is chaos, or a wrong minimum.
  constexpr double kGrowth = 4.0;
  const double length = now.fit.segment_s;
  const DataSet& data = now.problem->data();
  // Where nothing seems to be missing the whole runs are asked.
  const double longest = IsAtNoiseFloor(now)
                             ? data.LongestDuration()
                             : std::min(data.LongestDuration(),
                                        data.TotalDuration() / kFewestSegments);
  if (problem.options.segment > 0 || !now.fit.converged ||
      IsAsLong(length, longest)) {
    return std::nullopt;
  }
  report("longer segments", now.train_error());
  std::optional<EvaluatedModel> longer =
      EvaluateLonger(problem, now, std::min(2.0 * length, longest),
                     kMostIterationsToFollow, kGrowth * now.train_error());
  if (!longer ||
      longer->holdout_error() > kGrowth * std::max(1.0, now.holdout_error()) ||
      !Follows(*longer) || longer->fit.segment_s < 1.1 * length) {
    return std::nullopt;
  }
  return longer;
}

std::optional<EvaluatedModel> LengthenTo(const DiagnosisProblem& problem,
                                         double length, EvaluatedModel now) {
  while (!IsAsLong(now.fit.segment_s, length)) {
    if (!Follows(now)) return std::nullopt;
    const double before = now.fit.segment_s;
    std::optional<EvaluatedModel> longer =
        EvaluateLonger(problem, now, std::min(2.0 * before, length),
                       kMostIterationsToFollow, kInfinity);
    if (!longer || !(longer->fit.segment_s > before)) return std::nullopt;
    now = *std::move(longer);
  }
  return now;
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

ShootingProblem WithAllRuns(const DiagnosisProblem& problem,
                            const EvaluatedModel& evaluated) {
  const EstimationOptions quiet = QuietOptions(problem, evaluated);
  std::vector<Run> runs = RunsOf(*problem.train);
  if (problem.holdout != nullptr) {
    std::vector<Run> held_out = RunsOf(*problem.holdout);
    if (problem.judged_by_others) {
      std::move(held_out.begin(), held_out.end(), std::back_inserter(runs));
    } else {
      runs = JoinEnds(runs, held_out);
    }
  }
  return evaluated.problem->With(quiet)
      .WithData(MakeDataSetLike(problem.model, std::move(runs), quiet,
                                *problem.train))
      .StartingAt(evaluated.fit.point.theta);
}

std::optional<Fit> FitWholeRuns(const ShootingProblem& all,
                                const EvaluatedModel& evaluated) {
  // Times the error over segments, which a constant force makes of twice the
  // time: more is another minimum, or chaos.
  constexpr double kFollowed = 4.0;
  const double followed =
      kFollowed * std::max(evaluated.train_error(), evaluated.holdout_error());
  if (!IsRegular(*evaluated.problem, evaluated.fit.point)) return std::nullopt;
  EstimationOptions options = all.options();
  options.wanted_error = followed;
  Fit whole =
      FitLevenbergMarquardtFrom(all.With(options), evaluated.fit.segment_s);
  if (!whole.converged || !(whole.train.total.normalized_rms < followed)) {
    return std::nullopt;
  }
  return whole;
}

}  // namespace sysid
