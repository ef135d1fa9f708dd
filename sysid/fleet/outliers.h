#pragma once

#include <vector>

#include "sysid/fleet/random_effects.h"

namespace sysid {

// The probability that a fleet without an outlier has one named, alpha of
// (F.15), and likewise a drift: docs/fleet.md section 3 says why.
inline constexpr double kFleetLevel = 0.01;

// A robot compared with the random-effects mean of others, in which it has no
// part, (F.14). Without three others there is no comparison: NaN,
// and p is 1.
struct Deviation {
  RandomEffects others;
  double deviation = 0.0;  // d
  double p_value = 1.0;    // of this one comparison
};
Deviation CompareWithOthers(const RobotEstimate& estimate,
                            const std::vector<RobotEstimate>& others);

// Whether each is an outlier, (F.15), where `tests` comparisons are made in
// all.
std::vector<bool> FindOutliers(const std::vector<RobotEstimate>& estimates,
                               int tests);

// Each compared with those of the others that are no outliers.
std::vector<Deviation> CompareAll(const std::vector<RobotEstimate>& estimates,
                                  const std::vector<bool>& outlier);

}  // namespace sysid
