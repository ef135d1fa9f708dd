#include <algorithm>
#include <utility>

#include "glog/logging.h"
#include "models/dynamics_tangent.h"

// Of a DynamicsTangent the laws that read more than their joint, of pairs of
// joints, and the rates of internal states: what they read, and their columns.
// Equation numbers: docs/theory.md.

namespace sysid {

void DynamicsTangent::AddWideLaw(int i, const Law& law, bool rate) {
  const Effect& effect = model_->effects().effect(i);
  WideLaw wide;
  wide.law = law;
  const int states = static_cast<int>(effect.states().size());
  wide.of = rate                          ? WideLaw::Of::kRate
            : law.body < 0                ? WideLaw::Of::kGravity
            : effect.hooks() & kDriveHook ? WideLaw::Of::kDrive
            : effect.hooks() & kLimitHook ? WideLaw::Of::kLimit
            : effect.hooks() & kPairHook  ? WideLaw::Of::kPair
                                          : WideLaw::Of::kJoint;
  wide.rows = rate                            ? states
              : law.body < 0                  ? 3
              : wide.of == WideLaw::Of::kPair ? 2
                                              : 1;
  CHECK_LE(wide.rows, 3) << effect.name();
  wide.first_held = model_->held_index(i);
  wide.first_z = states > 0 ? model_->z_index(i) : 0;
  const auto add = [&](Argument::Of of, int place, int v) {
    wide.arguments.push_back({of, place, v});
  };
  const auto add_joint = [&](const Body& body) {
    add(Argument::Of::kQ, body.q_index, body.v_index);
    add(Argument::Of::kQd, body.v_index, body.v_index);
  };
  if (wide.of == WideLaw::Of::kPair) {
    const int second =
        model_->mechanism().joints[effect.second_joint()].child_link;
    wide.v = model_->bodies()[law.body].v_index;
    wide.v_second = model_->bodies()[model_->placement(second).body].v_index;
    for (const int v : {wide.v, wide.v_second}) add(Argument::Of::kQd, v, v);
  } else if (law.body >= 0) {
    const Body& body = model_->bodies()[law.body];
    wide.v = body.v_index;
    add_joint(body);
    for (const int joint : effect.other_joints()) {
      const int child = model_->mechanism().joints[joint].child_link;
      add_joint(model_->bodies()[model_->placement(child).body]);
    }
    if (effect.hooks() & (kReadsEffort | kLimitHook)) {
      add(Argument::Of::kEffort, body.v_index, body.v_index);
    }
  }
  for (size_t k = 0; k < effect.inputs().size(); ++k) {
    const int place = wide.first_held + static_cast<int>(k);
    add(Argument::Of::kHeld, place, place);
  }
  for (int k = 0; k < states; ++k) {
    add(Argument::Of::kZ, wide.first_z + k, wide.first_z + k);
  }
  wide.q.resize(model_->nq());
  wide.qd.resize(model_->nv());
  wide.held.resize(model_->held_size());
  wide.z.resize(model_->layout().nz());
  wide_.push_back(std::move(wide));
}

Lanes DynamicsTangent::WideColumn(const WideLaw& wide,
                                  const ParameterColumns& theta,
                                  const Moved& moved, int row) const {
  Lanes d = ZeroLanes();
  for (const Argument& x : wide.arguments) {
    switch (x.of) {
      case Argument::Of::kQ:
        d += moved.dq[x.v] * x.by[row];
        break;
      case Argument::Of::kQd:
        d += moved.dqd[x.v] * x.by[row];
        break;
      case Argument::Of::kHeld:
        if (moved.dheld != nullptr) d += moved.dheld[x.v] * x.by[row];
        break;
      case Argument::Of::kEffort:
        d += drive_lanes_[x.v] * x.by[row];
        break;
      case Argument::Of::kZ:
        d += moved.dz[x.v] * x.by[row];
    }
  }
  for (size_t j = 0; j < wide.law.p.size(); ++j) {
    const ParameterColumns::OfNumber& by = theta.effects[wide.law.first + j];
    if (by.moves) d += by.d * wide.law.by_p[j][row];
  }
  return d;
}

// (2.33): what the drives give, to drive_lanes_, and what laws give beside it.
void DynamicsTangent::WideColumns(const ParameterColumns& theta,
                                  const Moved& by) {
  for (size_t v = 0; v < drive_lanes_.size(); ++v) {
    drive_lanes_[v] = by.dheld == nullptr ? ZeroLanes() : by.dheld[v];
    wide_lanes_[v] = ZeroLanes();
  }
  for (const WideLaw& wide : wide_) {
    if (wide.of > WideLaw::Of::kPair) continue;
    const Lanes d = WideColumn(wide, theta, by, 0);
    switch (wide.of) {
      case WideLaw::Of::kDrive:
        drive_lanes_[wide.v] += d;
        break;
      case WideLaw::Of::kLimit:
        drive_lanes_[wide.v] = d;
        break;
      case WideLaw::Of::kPair:
        wide_lanes_[wide.v_second] += WideColumn(wide, theta, by, 1);
        [[fallthrough]];
      default:
        wide_lanes_[wide.v] += d;
    }
  }
}

void DynamicsTangent::RateColumns(const ParameterColumns& theta,
                                  const Moved& by, Lanes* rate) const {
  std::fill_n(rate, model_->layout().nz(), ZeroLanes());
  for (const WideLaw& wide : wide_) {
    if (wide.of != WideLaw::Of::kRate) continue;
    for (int k = 0; k < wide.rows; ++k) {
      rate[wide.first_z + k] = WideColumn(wide, theta, by, k);
    }
  }
}

}  // namespace sysid
