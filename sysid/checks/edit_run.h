#pragma once

#include <vector>

#include "models/mechanism.h"
#include "residuals/run.h"
#include "sysid/io/run_columns.h"

namespace sysid {

// What a hypothesis about the data does to a run. Joints by index.

enum Parts { kMotion = 1, kEffort = 2 };  // q and qd; tau

// Of a joint of one degree of freedom.
inline void ScaleJoint(const Mechanism& mechanism, int joint, int parts,
                       double factor, Run* run) {
  if (parts & kMotion) {
    for (const ChannelKind kind :
         {ChannelKind::kPosition, ChannelKind::kVelocity}) {
      Channel* channel = FindChannel(run, kind, joint);
      if (channel != nullptr) channel->values *= factor;
    }
  }
  if (parts & kEffort) {
    run->effort.col(mechanism.joints[joint].v_index) *= factor;
  }
}

// Two joints of one degree of freedom.
inline void SwapJoints(const Mechanism& mechanism, int a, int b, int parts,
                       Run* run) {
  if (parts & kMotion) {
    for (const ChannelKind kind :
         {ChannelKind::kPosition, ChannelKind::kVelocity}) {
      Channel* of_a = FindChannel(run, kind, a);
      Channel* of_b = FindChannel(run, kind, b);
      if (of_a != nullptr && of_b != nullptr) of_a->values.swap(of_b->values);
    }
  }
  if (parts & kEffort) {
    run->effort.col(mechanism.joints[a].v_index)
        .swap(run->effort.col(mechanism.joints[b].v_index));
  }
}

// Moving joints of one degree of freedom whose position is measured anywhere.
inline bool IsSimple(const Joint& joint) {
  return joint.type != JointType::kFixed && joint.type != JointType::kSpherical;
}

}  // namespace sysid
