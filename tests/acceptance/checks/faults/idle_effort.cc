// Efforts that moved something else.

#include <algorithm>
#include <cmath>

#include "tests/acceptance/checks/faults/plant.h"
#include "tests/acceptance/checks/faults/shipped_faults.h"

namespace sysid {
namespace {

// Efforts that have nothing to do with those of the motion: backwards, of
// either sign, and slower, for a sine that is read backwards is a late one;
// begun at a place where they are not alike by chance.
Eigen::VectorXd OfAnotherExperiment(const Eigen::VectorXd& effort, Dice* dice) {
  constexpr double kSpeed = 0.63, kUnlike = 0.15;
  const int n = static_cast<int>(effort.size());
  const double sign = dice->Sign();
  const Eigen::VectorXd was = effort.array() - effort.mean();
  Eigen::VectorXd other(n), best = effort;
  double least = 1.0;
  for (int tries = 0; tries < 100 && least > kUnlike; ++tries) {
    const int begin = dice->Below(n);
    for (int k = 0; k < n; ++k) {
      other[k] =
          sign * effort[(begin + n - 1 - static_cast<int>(kSpeed * k)) % n];
    }
    const Eigen::VectorXd centred = other.array() - other.mean();
    const double alike =
        std::abs(centred.dot(was)) / (centred.norm() * was.norm());
    if (alike < least) {
      least = alike;
      best = other;
    }
  }
  return best;
}

}  // namespace

std::vector<Fault> IdleEffortFaults() {
  return {
      OfJoint("effort_idle", {}, DrivenJoints,
              [](int j, Dice* dice, const Session& s, Run* run) {
                const int v = s.model.mechanism().joints[j].v_index;
                run->effort.col(v) =
                    OfAnotherExperiment(run->effort.col(v), dice);
              }),
  };
}

}  // namespace sysid
