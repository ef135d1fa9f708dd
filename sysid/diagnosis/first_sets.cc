#include "sysid/diagnosis/first_sets.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"

namespace sysid {
namespace {

// Drops the effects of which a parameter ended at a bound: each is no more than
// a column that helped. True where there were any.
bool DropAtBound(const EvaluatedModel& model,
                 std::vector<ScreenedEffect>* effects) {
  std::set<std::string> bound;
  for (const ParameterEstimate& p : model.fit.parameters) {
    if (p.at_bound) bound.insert(p.name);
  }
  return 0 < std::erase_if(*effects, [&](const ScreenedEffect& effect) {
           const std::vector<std::string> own = effect.effect->ParameterNames();
           return std::any_of(
               own.begin(), own.end(),
               [&](const std::string& name) { return bound.contains(name); });
         });
}

}  // namespace

EquationLook LookAtEquations(const DiagnosisProblem& problem,
                             const Candidates& candidates) {
  return LookByEquations(ShootingProblem(problem.model, problem.free,
                                         problem.train, problem.options),
                         candidates, problem.known, kMostEffectsBySegments);
}

std::shared_ptr<EvaluatedModel> FitByEquations(
    const DiagnosisProblem& problem, const EvaluatedModel& base,
    std::vector<ScreenedEffect>* effects) {
  std::shared_ptr<EvaluatedModel> model;
  do {
    model = std::make_shared<EvaluatedModel>(
        EvaluateByEquations(problem, base, *effects));
  } while (DropAtBound(*model, effects));
  return model;
}

EvaluatedModel EstimateByEquations(const DiagnosisProblem& problem,
                                   std::vector<ScreenedEffect>* effects) {
  for (;;) {
    EvaluatedModel model = OpenAtExpected(problem, *effects, problem.options);
    model.fit = FitInverseDynamics(*model.problem);
    if (DropAtBound(model, effects)) continue;
    if (problem.holdout != nullptr) {
      const ShootingProblem held_out =
          ShootingProblem(model.fit.model, {}, problem.train, problem.options)
              .WithData(problem.holdout);
      Solution start = ShortSegments(held_out);
      start.rollout = model.fit.point.rollout;
      model.holdout = EvaluateErrors(held_out, start, 0.0);
    }
    return model;
  }
}

std::vector<ScreenedEffect> DrivesWithoutEffort(const DiagnosisProblem& problem,
                                                const Candidates& candidates) {
  std::vector<ScreenedEffect> drives;
  for (const auto& candidate : candidates) {
    if (!(candidate->hooks() & kDriveHook)) continue;
    const Joint& joint = problem.model.mechanism().joints[candidate->joint()];
    const auto is_driven = [&](const auto& one) {
      return HasEffort(one->run, joint.v_index);
    };
    const auto& runs = problem.train->runs();
    if (problem.model.effects().Contains(candidate->name()) ||
        std::any_of(runs.begin(), runs.end(), is_driven)) {
      continue;
    }
    drives.emplace_back().effect = candidate;
    // Nothing moves the joint without it: that needs no test.
    drives.back().p_value = std::nan("");
  }
  return drives;
}

}  // namespace sysid
