// Numbers that a sensor spoils.

#include <algorithm>
#include <cmath>

#include "sysid/checks/readings/edit_run.h"
#include "tests/acceptance/checks/faults/plant.h"
#include "tests/acceptance/checks/faults/shipped_faults.h"

namespace sysid {
namespace {

void Freeze(int j, Dice* dice, const Session&, Run* run) {
  Channel* q = PositionOf(run, j);
  const int n = run->size();
  // Where it moves at least a fifth of its range meanwhile.
  const double least = 0.2 * SpanOf(*q);
  const int length =
      static_cast<int>(0.2 * n / (run->t.back() - run->t.front()));
  for (int tries = 0; tries < 1000; ++tries) {
    const int first = dice->Below(n - length - 1);
    const double value = q->values(first, 0);
    if (std::abs(q->values(first + length, 0) - value) < least && tries < 999) {
      continue;
    }
    q->values.middleRows(first, length).setConstant(value);
    return;
  }
}

// A slide without friction that drifts is one that moves (Galilei).
std::vector<int> JointsThatFeelTheirPlace(const Session& session) {
  std::vector<int> joints = JointsOnTime(session);
  std::erase_if(joints, [&](int j) {
    return !IsRotation1(session.model.mechanism().joints[j].type) &&
           session.model.effects().size() == 0;
  });
  return joints;
}

}  // namespace

std::vector<Fault> ValueFaults() {
  return {
      OfJoint("quantisation", {}, SimpleJoints,
              [](int j, Dice* dice, const Session&, Run* run) {
                Channel* q = PositionOf(run, j);
                const double step = SpanOf(*q) / dice->Uniform(30, 90);
                for (double& v : q->values.reshaped()) {
                  v = step * std::round(v / step);
                }
              }),
      OfJoint("saturation", {}, SimpleJoints,
              [](int j, Dice* dice, const Session&, Run* run) {
                Channel* q = PositionOf(run, j);
                const double top = q->values.maxCoeff() -
                                   dice->Uniform(0.15, 0.3) * SpanOf(*q);
                q->values = q->values.cwiseMin(top);
              }),
      OfJoint("spikes", {}, SimpleJoints,
              [](int j, Dice* dice, const Session&, Run* run) {
                Channel* q = PositionOf(run, j);
                const double range = SpanOf(*q);
                for (int i = 0; i < 5; ++i) {
                  q->values(dice->Below(run->size()), 0) +=
                      dice->EitherSign(0.7, 2.0) * range;
                }
              }),
      OfJoint("effort_spikes", {"spikes"}, DrivenJoints,
              [](int j, Dice* dice, const Session& s, Run* run) {
                auto tau =
                    run->effort.col(s.model.mechanism().joints[j].v_index);
                const double range = tau.maxCoeff() - tau.minCoeff();
                for (int i = 0; i < 5; ++i) {
                  tau[dice->Below(run->size())] +=
                      dice->EitherSign(1.5, 3.0) * range;
                }
              }),
      OfJoint("frozen", {}, SimpleJoints, Freeze),
      OfJoint("drift", {}, JointsThatFeelTheirPlace,
              [](int j, Dice* dice, const Session&, Run* run) {
                const double rate = dice->EitherSign(0.04, 0.1);
                Channel* q = PositionOf(run, j);
                for (int k = 0; k < run->size(); ++k) {
                  q->values(k, 0) += rate * run->t[k];
                }
              }),
  };
}

}  // namespace sysid
