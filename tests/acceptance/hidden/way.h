#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "residuals/run.h"
#include "sysid/diagnosis/evaluated_model.h"

namespace sysid {

// Ways that must lead to the same answer: from the model as given, from two
// effects at random, from the truth and one more at random; with the candidates
// in another order; with every sample changed by 1e-13 of itself.
enum class Way { kGiven, kTwoWrong, kOneMore, kShuffled, kPerturbed };
inline constexpr Way kAllWays[] = {Way::kGiven, Way::kTwoWrong, Way::kOneMore,
                                   Way::kShuffled, Way::kPerturbed};

const char* NameOf(Way way);
// kGiven of a name that none has.
Way WayOf(const std::string& name);

// Where a search on this way begins: indices of candidates, ascending. Shuffles
// the candidates where that is the way.
std::vector<int> BeginOn(Way way, uint64_t seed,
                         const std::vector<std::string>& truth,
                         Candidates* candidates);

// Changes every sample by 1e-13 of itself, up and down by turns.
void Perturb(std::vector<Run>* runs);

}  // namespace sysid
