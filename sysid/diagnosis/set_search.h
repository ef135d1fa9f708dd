#pragma once

#include <vector>

#include "sysid/diagnosis/linear_sets.h"

namespace sysid {

// A set of effects as a linearisation predicts it: of its terms those that
// leave least.
struct PredictedSet {
  LinearSets::Score score;
  Eigen::ArrayXd log_errors;  // (J.3), by stretch with data
  double mean = 0.0;          // of those
};

// The sets about a fitted model that leave least, by a beam search over terms
// (section 4 of docs/judgement.md): one for each set of effects, the best
// first.
std::vector<PredictedSet> SearchSets(const LinearSets& sets);

}  // namespace sysid
