// Quaternions written by another convention.

#include "sysid/checks/readings/edit_run.h"
#include "tests/acceptance/checks/faults/plant.h"
#include "tests/acceptance/checks/faults/shipped_faults.h"

namespace sysid {
namespace {

void Permute(bool inverse, int joint, Run* run) {
  Channel* channel = ChannelOf(run, ChannelKind::kOrientation, joint);
  const RowMatrixXd was = channel->values;  // x, y, z, w
  if (inverse) {
    channel->values.leftCols(3) = -was.leftCols(3);
  } else {
    // What was written x, y, z, w is read as w, x, y, z.
    channel->values.col(3) = was.col(0);
    channel->values.col(0) = was.col(1);
    channel->values.col(1) = was.col(2);
    channel->values.col(2) = was.col(3);
  }
}

}  // namespace

std::vector<Fault> QuaternionFaults() {
  return {
      OfJoint("quaternion_order", {}, BallJoints,
              [](int j, Dice*, const Session&, Run* run) {
                Permute(false, j, run);
              }),
      OfJoint("quaternion_inverse", {}, BallJoints,
              [](int j, Dice*, const Session&, Run* run) {
                Permute(true, j, run);
              }),
  };
}

}  // namespace sysid
