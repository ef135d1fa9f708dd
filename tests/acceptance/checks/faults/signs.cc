// Axes and efforts the other way round.

#include "sysid/checks/readings/edit_run.h"
#include "tests/acceptance/checks/faults/plant.h"
#include "tests/acceptance/checks/faults/shipped_faults.h"

namespace sysid {

std::vector<Fault> SignFaults() {
  return {
      OfJoint("axis_flipped", {}, JointsBesideAnother,
              [](int j, Dice*, const Session& s, Run* run) {
                ScaleJoint(s.model.mechanism(), j, kMotion, -1.0, run);
              }),
      OfJoint("effort_flipped", {"axis_flipped"}, DrivenJoints,
              [](int j, Dice*, const Session& s, Run* run) {
                ScaleJoint(s.model.mechanism(), j, kEffort, -1.0, run);
              }),
  };
}

}  // namespace sysid
