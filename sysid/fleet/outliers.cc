#include "sysid/fleet/outliers.h"

#include <cmath>
#include <limits>

namespace sysid {
namespace {

constexpr size_t kFewestOthers = 3;

// Those for which `in` is set, but for number `without`.
std::vector<RobotEstimate> Others(const std::vector<RobotEstimate>& estimates,
                                  const std::vector<bool>& in, size_t without) {
  std::vector<RobotEstimate> others;
  for (size_t i = 0; i < estimates.size(); ++i) {
    if (in[i] && i != without) others.push_back(estimates[i]);
  }
  return others;
}

}  // namespace

Deviation CompareWithOthers(const RobotEstimate& estimate,
                            const std::vector<RobotEstimate>& others) {
  Deviation result;
  result.deviation = std::numeric_limits<double>::quiet_NaN();
  if (others.size() < kFewestOthers) return result;
  result.others = PoolEstimates(others);
  const double v = estimate.std_error * estimate.std_error +
                   result.others.tau2 +
                   result.others.std_error * result.others.std_error;
  result.deviation =
      (estimate.value - result.others.mean) / std::sqrt(v);  // (F.14)
  result.p_value =
      StudentTails(result.deviation, result.others.DegreesOfFreedom(v));
  return result;
}

std::vector<bool> FindOutliers(const std::vector<RobotEstimate>& estimates,
                               int tests) {
  const size_t k = estimates.size();
  std::vector<bool> remains(k, true);
  std::vector<size_t> removed;
  size_t outliers = 0;  // of those, the first
  while (2 * (removed.size() + 1) < k &&
         k - removed.size() - 1 >= kFewestOthers) {
    size_t worst = k;
    Deviation most;
    for (size_t i = 0; i < k; ++i) {
      if (!remains[i]) continue;
      const Deviation one =
          CompareWithOthers(estimates[i], Others(estimates, remains, i));
      // Of those that are off beyond what a double can say, the farthest.
      if (worst == k || one.p_value < most.p_value ||
          (one.p_value == most.p_value &&
           std::abs(one.deviation) > std::abs(most.deviation))) {
        worst = i;
        most = one;
      }
    }
    remains[worst] = false;
    removed.push_back(worst);
    if (tests * most.p_value <= kFleetLevel) outliers = removed.size();
  }
  std::vector<bool> outlier(k, false);
  for (size_t j = 0; j < outliers; ++j) outlier[removed[j]] = true;
  return outlier;
}

std::vector<Deviation> CompareAll(const std::vector<RobotEstimate>& estimates,
                                  const std::vector<bool>& outlier) {
  std::vector<bool> in(estimates.size());
  for (size_t i = 0; i < in.size(); ++i) in[i] = !outlier[i];
  std::vector<Deviation> all;
  for (size_t i = 0; i < estimates.size(); ++i) {
    all.push_back(CompareWithOthers(estimates[i], Others(estimates, in, i)));
  }
  return all;
}

}  // namespace sysid
