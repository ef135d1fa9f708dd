#pragma once

#include <memory>
#include <vector>

#include "sysid/diagnosis/evaluated_model.h"

namespace sysid {

// Sets of effects from which a search begins beside the model as given: what
// the equations of motion show, and what must be there for the machine to move.

// The base with effects, at the values that the equations of motion give them
// all; without those that end at a bound.
std::shared_ptr<EvaluatedModel> FitByEquations(
    const DiagnosisProblem& problem, const EvaluatedModel& base,
    std::vector<ScreenedEffect>* effects);

// Whether a fit of the motion takes minutes: by Jets, or by the small steps of
// the smoothed friction of pairs, of a model with so many effects that the
// equations of motion begin its search.
bool FitsTakeMinutes(const Model& model);

// The drives of joints that are commanded and whose efforts nobody recorded:
// without them such a machine would not move at all, and whatever else moves it
// would be taken for them.
std::vector<ScreenedEffect> DrivesWithoutEffort(const DiagnosisProblem& problem,
                                                const Candidates& candidates);

}  // namespace sysid
