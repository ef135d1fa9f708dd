#include "tests/acceptance/hidden/way.h"

#include <algorithm>
#include <random>

namespace sysid {
namespace {

// Adds a candidate, unless it shares a parameter with one that is there.
void Add(size_t at, const Candidates& candidates, std::vector<int>* start) {
  const auto shares = [&](int other) {
    for (const EffectParameter& a : candidates[at]->parameters()) {
      for (const EffectParameter& b : candidates[other]->parameters()) {
        if (a.name == b.name) return true;
      }
    }
    return static_cast<size_t>(other) == at;
  };
  if (std::any_of(start->begin(), start->end(), shares)) return;
  start->push_back(static_cast<int>(at));
}

}  // namespace

const char* NameOf(Way way) {
  switch (way) {
    case Way::kTwoWrong:
      return "two_wrong";
    case Way::kOneMore:
      return "one_more";
    case Way::kShuffled:
      return "shuffled";
    case Way::kPerturbed:
      return "perturbed";
    case Way::kGiven:
      break;
  }
  return "given";
}

Way WayOf(const std::string& name) {
  for (const Way way : kAllWays) {
    if (name == NameOf(way)) return way;
  }
  return Way::kGiven;
}

std::vector<int> BeginOn(Way way, uint64_t seed,
                         const std::vector<std::string>& truth,
                         Candidates* candidates) {
  std::mt19937_64 random(seed);
  std::vector<int> start;
  if (way == Way::kShuffled) {
    std::shuffle(candidates->begin(), candidates->end(), random);
  }
  if (way != Way::kTwoWrong && way != Way::kOneMore) return start;
  if (way == Way::kOneMore) {
    for (const std::string& name : truth) {
      for (size_t i = 0; i < candidates->size(); ++i) {
        if ((*candidates)[i]->name() == name) Add(i, *candidates, &start);
      }
    }
  }
  const size_t size = way == Way::kTwoWrong ? 2 : start.size() + 1;
  std::uniform_int_distribution<size_t> any(0, candidates->size() - 1);
  for (int tries = 0; start.size() < size && tries < 100; ++tries) {
    Add(any(random), *candidates, &start);
  }
  std::sort(start.begin(), start.end());
  return start;
}

void Perturb(std::vector<Run>* runs) {
  double sign = 1.0;
  for (Run& run : *runs) {
    for (Channel& channel : run.channels) {
      for (double& value : channel.values.reshaped()) {
        value *= 1.0 + 1e-13 * (sign = -sign);
      }
    }
  }
}

}  // namespace sysid
