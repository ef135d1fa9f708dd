// Numbers in another unit.

#include <cmath>

#include "sysid/checks/readings/edit_run.h"
#include "tests/acceptance/checks/faults/plant.h"
#include "tests/acceptance/checks/faults/shipped_faults.h"

namespace sysid {

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
  };
}

}  // namespace sysid
