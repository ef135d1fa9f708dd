// Numbers in another unit.

#include <cmath>

#include "sysid/checks/readings/edit_run.h"
#include "tests/acceptance/checks/faults/plant.h"
#include "tests/acceptance/checks/faults/shipped_faults.h"

namespace sysid {

namespace {

// A slide alone whose mass is fitted has any unit of force.
std::vector<int> DrivenBesideWeights(const Session& session) {
  return Hinges(session).empty() ? std::vector<int>{} : DrivenJoints(session);
}

}  // namespace

std::vector<Fault> UnitFaults() {
  return {
      OfJoint("degrees", {}, Hinges,
              [](int j, Dice*, const Session& s, Run* run) {
                ScaleJoint(s.model.mechanism(), j, kMotion, 180 / M_PI, run);
              }),
      OfJoint("millimetres", {}, Slides,
              [](int j, Dice*, const Session& s, Run* run) {
                ScaleJoint(s.model.mechanism(), j, kMotion, 1000.0, run);
              }),
      OfRun("milliseconds",
            [](Dice*, Run* run) {
              for (double& t : run->t) t *= 1000.0;
            }),
      // N cm, N mm, kN m; a gear.
      OfJoint("effort_scale", {}, DrivenBesideWeights,
              [](int j, Dice* dice, const Session& s, Run* run) {
                constexpr double kFactors[] = {100.0, 1000.0, 0.001, 5.0, 0.2};
                ScaleJoint(s.model.mechanism(), j, kEffort,
                           kFactors[dice->Below(5)], run);
              }),
  };
}

}  // namespace sysid
