#pragma once

#include <memory>
#include <vector>

#include "sysid/diagnosis/evaluated_model.h"
#include "sysid/inverse_dynamics/equation_look.h"

namespace sysid {

// Sets of effects from which a search begins beside the model as given: what
// the equations of motion show, and what must be there for the machine to move.

// What the equations of motion show of a problem: which effects are missing,
// and whether it is an arm, of which they are the answer.
EquationLook LookAtEquations(const DiagnosisProblem& problem,
                             const Candidates& candidates);

// The base with effects, at the values that the equations of motion give them
// all; without those that end at a bound.
std::shared_ptr<EvaluatedModel> FitByEquations(
    const DiagnosisProblem& problem, const EvaluatedModel& base,
    std::vector<ScreenedEffect>* effects);

// The problem's model with effects, all that is free fitted to the equations
// of motion alone (FitInverseDynamics), but for effects that end at a bound,
// which go. Judged by predictions over short segments from measured states: no
// stretches.
EvaluatedModel EstimateByEquations(const DiagnosisProblem& problem,
                                   std::vector<ScreenedEffect>* effects);

// The drives of joints that are commanded and whose efforts nobody recorded:
// without them such a machine would not move at all, and whatever else moves it
// would be taken for them.
std::vector<ScreenedEffect> DrivesWithoutEffort(const DiagnosisProblem& problem,
                                                const Candidates& candidates);

}  // namespace sysid
