#include "sysid/estimation/stages.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "models/math/constants.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/step_size.h"

namespace sysid {
namespace {

// Predictions that are off by this have lost the motion.
constexpr double kLost = 1.0;  // rad or m

bool FreesEffects(const ShootingProblem& problem) {
  return std::any_of(problem.free().begin(), problem.free().end(),
                     [](const FreeParameter& free) {
                       return free.parameter.kind == ParameterKind::kEffect;
                     });
}

}  // namespace

const std::shared_ptr<ShootingSegments>& Stages::Segments() {
  if (segments_ == nullptr || !segments_->Fit(solution)) {
    segments_ =
        std::make_shared<ShootingSegments>(problem_, solution, TangentStep());
  }
  return segments_;
}

// Channels whose errors are not those of the noise have one size each that the
// data tells: with s_c^2 the mean square of channel c,
//
//   max over s of  -sum_c N_c (log s_c + e_c^2 / (2 s_c^2))
//
// is at s_c = e_c (Bard 1974, section 4-5: an error covariance that is unknown
// and diagonal; in flight tests, the relaxation of the output-error method).
// Only the ratio of the channels counts: what all of them leave inflates the
// errors. A robust loss bends what is missed instead: the size of spikes would
// undo it.
bool Stages::Weigh() {
  // Even weights for channels that differ by this much make a standard error a
  // sixth wider at most, which is not worth a round.
  constexpr double kWorth = 2.0;
  constexpr double kSettled = 1.25;
  const bool bends = problem_.options().loss != RobustLoss::kNone;
  if (!weighs_ || bends) return false;
  const RunErrors& errors = Errors();
  std::map<std::string, double> misfit;
  double least = kInfinity;
  for (const ChannelError& channel : errors.channels) {
    if (!std::isfinite(channel.normalized_rms)) return false;
    const double s =
        channel.normalized_rms < kMissing ? 1.0 : channel.normalized_rms;
    misfit[channel.name] = s;
    least = std::min(least, s);
  }
  const double much = weighed_ ? kSettled : kWorth;
  bool changed = false;
  for (auto& [name, s] : misfit) {
    s /= least;
    const double ratio = s / problem_.Misfit(name);
    changed = changed || ratio > much || ratio * much < 1.0;
  }
  if (!changed) return false;
  weighed_ = true;
  problem_ = problem_.Weighing(std::move(misfit));
  segments_.reset();
  return true;
}

double Stages::EquationsWeight() const {
  if (problem_.equations() == nullptr) return 0.0;
  const double square = WeighedSquare(problem_, Errors());
  return std::sqrt(square * AutocorrelationTime(problem_, solution));
}

bool Stages::IsWhole() const {
  const auto is_one = [](const Solution::Nodes& nodes) {
    return nodes.segments() == 1;
  };
  return AllTrue(
      problem_.processes(),
      std::all_of(solution.runs.begin(), solution.runs.end(), is_one));
}

// From the error e of segments of length L: where errors grow fourfold over one
// (ChooseSegment), 16 e is that two segments later; else that of a force which
// the model misses grows by the square of time, to e (T / L)^2 over T.
bool Stages::LosesMotion(bool chaotic) const {
  const double lengths =
      problem_.data().LongestDuration() / MeanSegment(problem_, solution);
  const double growth = chaotic ? 16.0 : lengths * lengths;
  return Rms() * growth > kLost;
}

bool Stages::ShortenStep() {
  if (!choose_step_ || !AdaptRollout(problem_, &solution)) return false;
  unrefined_ = RolloutOptions();
  return true;
}

void Stages::RefineStep(double defect) {
  if (!choose_step_) return;
  unrefined_ = solution.rollout;
  solution.rollout.step = sysid::RefineStep(problem_, defect, solution);
}

double Stages::TangentStep() const { return Unrefined().rollout.step; }

Solution Stages::Unrefined() const {
  Solution unrefined = solution;
  if (unrefined_.integrator == solution.rollout.integrator &&
      unrefined_.step > 0.0) {
    unrefined.rollout = unrefined_;
  }
  return unrefined;
}

const RunErrors& Stages::Errors() const {
  // A process without runs cannot see that those of others have moved.
  if (!AllTrue(problem_.processes(), errors_ && errors_->first == solution)) {
    errors_.emplace(solution, EvaluateErrors(problem_, solution, 0.0));
  }
  return errors_->second;
}

StageSummary Stages::Logged(const std::string& doing,
                            const std::function<StageSummary()>& run) {
  doing_ = doing;
  if (log_ == nullptr) return run();
  ThrowIfCancelled(problem_.options().stop);
  if (std::optional<StageOutcome> before = log_->Next(doing)) {
    solution = std::move(before->solution);
    iterations = before->iterations;
    evaluations = before->evaluations;
    history.insert(history.end(), before->history.begin(),
                   before->history.end());
    if (!history.empty()) {
      start_s_ = std::min(start_s_, Now() - history.back().time_s);
    }
    return before->summary;
  }
  StageOutcome outcome;
  const size_t first = history.size();
  outcome.doing = doing;
  outcome.summary = run();
  outcome.solution = solution;
  outcome.iterations = iterations;
  outcome.evaluations = evaluations;
  outcome.history.assign(history.begin() + first, history.end());
  log_->Keep(outcome);
  return outcome.summary;
}

StageSummary Stages::Run(const StageGoal& goal) {
  const StageSummary done = Logged(goal.doing, [&] {
    defect_ = goal.defect;
    return Minimise(goal);
  });
  defect_ = goal.defect;
  ++ended;
  Measure();
  return done;
}

StageSummary Stages::Minimise(const StageGoal& goal) {
  constexpr int kMostSteps = 4;
  ShootingStage::Options options;
  options.far = goal.misfit > 0.0 && std::isfinite(goal.defect);
  options.twist_hold = std::max(1.0, goal.misfit);
  options.defect = goal.defect;
  options.misfit = misfit_;
  options.equations = goal.equations;
  options.news = goal.news;
  options.exact = goal.exact;
  options.wanted_error = goal.wanted;
  options.function_tolerance = goal.tolerance;
  StageSummary done;
  for (int i = 0; i < kMostSteps; ++i) {
    const int left = problem_.options().max_iterations - iterations;
    options.max_iterations = std::max(1, std::min(goal.most, left));
    ShootingStage stage(problem_, options, &solution, Segments());
    done = stage.Solve(goal.doing, start_s_, &history);
    iterations += done.iterations;
    evaluations += done.evaluations;
    // Again where the solution, or where it was heading, is too stiff; which
    // only effects can make it.
    if (!ShortenStep() || !FreesEffects(problem_)) break;
  }
  return done;
}

void Stages::Measure() {
  const double error = std::sqrt(WeighedSquare(problem_, Errors()));
  if (std::isfinite(error)) misfit_ = std::max(1.0, error);
}

StageSummary Stages::RunSegments(const StageGoal& goal) {
  return Logged(goal.doing, [&] {
    ThrowIfCancelled(problem_.options().stop);
    defect_ = kInfinity;
    solution = SolveSegments(problem_, solution,
                             {.twist_hold = std::max(1.0, goal.misfit),
                              .tolerance = goal.tolerance});
    ++iterations;
    StageSummary done;
    done.converged = true;
    done.message = "the states of each segment";
    return done;
  });
}

}  // namespace sysid
