#include "sysid/estimation/stages.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/step_size.h"

namespace sysid {
namespace {

bool FreesEffects(const ShootingProblem& problem) {
  return std::any_of(problem.free().begin(), problem.free().end(),
                     [](const FreeParameter& free) {
                       return free.parameter.kind == ParameterKind::kEffect;
                     });
}

}  // namespace

const std::shared_ptr<ShootingSegments>& Stages::Segments() {
  if (segments_ == nullptr || !segments_->Fit(solution)) {
    segments_ = std::make_shared<ShootingSegments>(problem_, solution);
  }
  return segments_;
}

Solution Stages::Recut(double length) const {
  return sysid::Recut(problem_, solution, length);
}

bool Stages::IsWhole() const {
  return SameCut(solution, Recut(std::numeric_limits<double>::infinity()));
}

bool Stages::ShortenStep() {
  if (!choose_step_) return false;
  double& step = solution.rollout.step;
  const double needed = ChooseStepAhead(problem_, solution);
  const bool shorter = step <= 0 || needed < 0.75 * step;
  if (shorter) step = needed;
  return shorter;
}

void Stages::RefineStep(double defect) {
  if (!choose_step_) return;
  solution.rollout.step = sysid::RefineStep(problem_, defect, solution);
}

double Stages::Error() const {
  return EvaluateErrors(problem_, solution, 0.0).total.normalized_rms;
}

StageSummary Stages::Run(const StageGoal& goal) {
  constexpr int kMostSteps = 4;
  doing_ = goal.doing;
  ShootingStage::Options options;
  options.far = goal.misfit > 0.0 && std::isfinite(goal.defect);
  options.twist_hold = std::max(1.0, goal.misfit);
  options.defect = goal.defect;
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

}  // namespace sysid
