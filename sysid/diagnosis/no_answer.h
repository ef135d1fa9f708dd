#pragma once

#include <string>

#include "sysid/diagnosis/evaluated_model.h"

namespace sysid {

// Why a set of effects that was fitted is no answer, however well it predicts.

// Why an effect that was added is not what it means; empty where it is.
std::string WhyImplausible(const EvaluatedModel& evaluated,
                           const Effect& effect);

// Of the effects that were added the one that a random force of the size that
// is still missing most likely makes up, by (6.7) of the fit of all runs, one
// trajectory each (where that cannot follow the motion, of the fit in
// segments); empty where none does at 95 %, all candidates paid for.
std::string LikeliestChance(const DiagnosisProblem& problem,
                            const EvaluatedModel& evaluated, size_t candidates);

}  // namespace sysid
