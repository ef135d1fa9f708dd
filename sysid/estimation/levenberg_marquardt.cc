#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/fit.h"
#include "sysid/estimation/fit_summary.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/preflight.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/step_size.h"

namespace sysid {
namespace {

// Segments grow by this factor a stage.
constexpr double kStageGrowth = 4.0;
// Above this many times the noise a model misses something, and one trajectory
// through all of a chaotic run is not to be had (nor worth anything).
constexpr double kMissing = 2.0;

// The stages of one fit; each starts where the last ended.
class StagedFit {
 public:
  explicit StagedFit(ShootingProblem* problem)
      : problem_(problem),
        choose_step_(problem->options().rollout.step <= 0),
        start_s_(Now()),
        fit_(problem->model()) {}

  // From the data: segments that grow, joined to one trajectory a run, or else
  // left independent of each other.
  Fit Run(bool joined);
  // Independent segments, from a point cut into them.
  Fit Refit(const ShootingPoint& start);
  Fit StatesAtStart(const ShootingPoint& cut);

 private:
  void Solve(bool joined);
  void SolveIndependent();
  void CountSamples();
  // Shortens the step, where it is ours to choose, to what the point and the
  // way ahead of it need. True where it changed.
  bool ShortenStep();
  bool FreesEffects() const;
  // Of the point as it is cut; they remember what the stage before found.
  std::shared_ptr<ShootingSegments> Segments();
  StageSummary Stage(const std::string& doing, double defect, double tolerance,
                     int most, double twist_hold = 0.0);
  // What was reached when a stage was stopped; false where it is the start.
  bool KeepBest();
  void Finish();
  void Predict();  // over horizons and whole runs

  ShootingProblem* problem_;
  const bool choose_step_;
  const double start_s_;
  std::vector<RowMatrixXd> from_data_;  // states at the samples of each run
  ShootingPoint point_;
  std::shared_ptr<ShootingSegments> segments_;
  std::string stage_;  // the one that runs, in words
  Fit fit_;
};

std::shared_ptr<ShootingSegments> StagedFit::Segments() {
  if (segments_ == nullptr || !segments_->Fit(*problem_, point_)) {
    segments_ = std::make_shared<ShootingSegments>(*problem_, point_);
  }
  return segments_;
}

bool StagedFit::ShortenStep() {
  if (!choose_step_) return false;
  double& step = problem_->mutable_options()->rollout.step;
  const double needed = ChooseStepAhead(*problem_, point_);
  const bool shorter = step <= 0 || needed < 0.75 * step;
  if (shorter) step = needed;
  return shorter;
}

bool StagedFit::FreesEffects() const {
  for (const FreeParameter& free : problem_->free()) {
    if (free.parameter.kind == ParameterKind::kEffect) return true;
  }
  return false;
}

StageSummary StagedFit::Stage(const std::string& doing, double defect,
                              double tolerance, int most, double twist_hold) {
  constexpr int kMostSteps = 4;
  stage_ = doing;
  ShootingStage::Options options;
  options.far = twist_hold > 0.0 && std::isfinite(defect);
  options.twist_hold = std::max(1.0, twist_hold);
  options.defect = defect;
  options.function_tolerance = tolerance;
  StageSummary done;
  for (int i = 0; i < kMostSteps; ++i) {
    const int left = problem_->options().max_iterations - fit_.iterations;
    options.max_iterations = std::max(1, std::min(most, left));
    ShootingStage stage(*problem_, options, &point_, Segments());
    done = stage.Solve(doing, start_s_, &fit_.history);
    fit_.iterations += done.iterations;
    fit_.evaluations += done.evaluations;
    // Again where the solution, or where it was heading, is too stiff; which
    // only effects can make it.
    if (!ShortenStep() || !FreesEffects()) break;
  }
  return done;
}

void StagedFit::Solve(bool joined) {
  constexpr int kUnlimited = 1 << 30;  // but for max_iterations
  ShootingPoint whole = point_;
  Recut(*problem_, std::numeric_limits<double>::infinity(), &whole);
  const bool single = SameCut(point_, whole);
  if (single) {
    // No shorter segments to begin with: hold the spin instead.
    const double missed =
        EvaluateErrors(*problem_, point_, 0.0).total.normalized_rms;
    Stage("first steps", kLooseDefect, 1e-2, 30, missed);
  } else {
    Stage("short segments", kLooseDefect, 1e-3, 30);
  }
  const double regular = ChooseSegment(*problem_, point_);
  const double possible = std::min(kLongestLength, problem_->LongestDuration());
  const bool chaotic = regular < possible * (1 - 1e-9);
  const double given = problem_->options().segment;
  const double last_length = given > 0 ? given : regular;
  for (double length = kFirstLength * kStageGrowth;
       length * kStageGrowth < last_length; length *= kStageGrowth) {
    Recut(*problem_, length, &point_);
    Stage("growing segments", kMiddleDefect, 1e-3, 10);
  }
  Recut(*problem_, last_length, &point_);
  ShortenStep();
  if (!joined) {
    // From the data: what the joined segments made of a spin that no sensor
    // sees is worth nothing.
    point_ = CutPoint(*problem_, point_.theta, from_data_, last_length);
    SolveIndependent();
    return;
  }
  if (!single) {
    // Joined by degrees: what the short segments leave open (a spin, a stiff
    // damping) would otherwise start the joined ones far off.
    for (const double defect : {kMiddleDefect, kCloseDefect}) {
      Stage("long segments", defect, 1e-3, 10);
    }
    Stage("joined segments", kJoinedDefect, 1e-4, kUnlimited);
  }
  const RunErrors errors = EvaluateErrors(*problem_, point_, 0.0);
  const bool one_trajectory =
      !chaotic || errors.total.normalized_rms < kMissing;
  fit_.defect = one_trajectory ? TightDefect(point_) : kJoinedDefect;
  if (choose_step_) RefineStep(problem_, fit_.defect, &point_);
  const StageSummary last =
      Stage("one trajectory", fit_.defect, 1e-7, kUnlimited);
  fit_.converged = last.converged;
  fit_.termination = last.message;
}

void StagedFit::SolveIndependent() {
  // To compare models: a hundredth of what makes a difference between two.
  constexpr double kEnough = 1e-5;
  constexpr double kNear = 2.0, kThere = 1.3;  // times the noise
  fit_.defect = std::numeric_limits<double>::infinity();
  StageSummary last =
      Stage("independent segments", fit_.defect, kEnough, 1 << 30, kHeldSpin);
  const auto error = [&] {
    return EvaluateErrors(*problem_, point_, 0.0).total.normalized_rms;
  };
  // A model that is nearly right may say itself how it spins, and the errors of
  // the step would look like something missing; one that so comes to the noise
  // was right.
  if (last.converged && error() < kNear) {
    const ShootingPoint held = point_;
    const double step = problem_->options().rollout.step;
    if (choose_step_) RefineStep(problem_, fit_.defect, &point_);
    const StageSummary free =
        Stage("independent segments", fit_.defect, kEnough, 1 << 30);
    if (error() < kThere) {
      last = free;
    } else {
      point_ = held;
      problem_->mutable_options()->rollout.step = step;
    }
  }
  fit_.converged = last.converged;
  fit_.termination = last.message;
}

// Ceres leaves its last successful step in the point, so that is the best of
// the stage that was stopped; the stages before ended at theirs.
bool StagedFit::KeepBest() {
  const int iterations =
      fit_.history.empty() ? 0 : fit_.history.back().iteration;
  if (!problem_->options().keep_best || iterations == 0) return false;
  fit_.iterations = iterations;
  fit_.converged = false;
  fit_.termination = InterruptedWords("after " + std::to_string(iterations) +
                                      " iterations, in the stage of " + stage_);
  return true;
}

void StagedFit::Finish() {
  double states = 0.0;  // that were estimated
  for (const ShootingPoint::Nodes& nodes : point_.runs) {
    states += std::isinf(fit_.defect) ? nodes.segments() : 1;
  }
  SummarizeFit(*problem_, point_,
               problem_->map().size() + ObservedStateDof(*problem_) * states,
               &fit_);
  fit_.wall_time_s = Now() - start_s_;
}

void StagedFit::Predict() {
  fit_.horizon = EvaluateHorizon(*problem_, point_.theta);
  fit_.open = EvaluateOpen(*problem_, point_);
  fit_.wall_time_s = Now() - start_s_;
}

void StagedFit::CountSamples() {
  for (const auto& run : problem_->runs()) fit_.samples += run->run.size();
  fit_.noise = problem_->PooledNoise();
}

Fit StagedFit::Refit(const ShootingPoint& start) {
  CountSamples();
  point_ = start;
  ShortenStep();
  SolveIndependent();
  Finish();
  return std::move(fit_);
}

Fit StagedFit::StatesAtStart(const ShootingPoint& cut) {
  CountSamples();
  point_ = cut;
  point_.theta = problem_->InitialTheta();
  const std::vector<RowMatrixXd> states = AllStatesFromData(*problem_);
  for (size_t r = 0; r < point_.runs.size(); ++r) {
    ShootingPoint::Nodes& nodes = point_.runs[r];
    for (int k = 0; k < nodes.segments(); ++k) {
      nodes.states.row(k) = states[r].row(nodes.samples[k]);
    }
  }
  fit_.defect = std::numeric_limits<double>::infinity();
  ShootingStage::Options options;
  options.defect = fit_.defect;
  options.fix_theta = true;
  options.twist_hold = kHeldSpin;
  options.function_tolerance = 1e-6;
  ShootingStage(*problem_, options, &point_, Segments())
      .Solve("states", start_s_, &fit_.history);
  Finish();
  return std::move(fit_);
}

Fit StagedFit::Run(bool joined) {
  CountSamples();
  from_data_ = AllStatesFromData(*problem_);
  point_ =
      CutPoint(*problem_, problem_->InitialTheta(), from_data_, kFirstLength);
  ShortenStep();
  fit_.termination = WhyHopeless(*problem_, point_, Segments().get());
  if (fit_.termination.empty()) {
    try {
      Solve(joined);
    } catch (const Cancelled&) {
      if (!joined || !KeepBest()) throw;
    }
  }
  // What is left is short, and makes the point one that is worth keeping.
  if (joined && problem_->options().keep_best) {
    problem_->mutable_options()->stop = {};
  }
  Finish();
  if (joined) Predict();
  return std::move(fit_);
}

}  // namespace

Fit FitLevenbergMarquardt(ShootingProblem* problem) {
  return StagedFit(problem).Run(true);
}

Fit FitIndependentSegments(ShootingProblem* problem) {
  return StagedFit(problem).Run(false);
}

Fit StatesAtStart(ShootingProblem* problem, const ShootingPoint& cut) {
  return StagedFit(problem).StatesAtStart(cut);
}

Fit RefitIndependentSegments(ShootingProblem* problem,
                             const ShootingPoint& start) {
  return StagedFit(problem).Refit(start);
}

}  // namespace sysid
