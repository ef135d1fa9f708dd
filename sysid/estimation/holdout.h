#pragma once

#include <vector>

#include "sysid/estimation/evaluation.h"

namespace sysid {

// Runs that a model is to predict, with the noise of those that were fitted;
// nothing is estimated yet.
Holdout OpenHoldout(const Model& model, std::vector<Run> runs,
                    const ShootingProblem& train, double segment_s);

}  // namespace sysid
