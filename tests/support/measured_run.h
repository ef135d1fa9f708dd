#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "residuals/segment.h"
#include "tests/support/link_poses.h"
#include "tests/support/random_mechanism.h"

namespace sysid {

// What a channel without noise would say at the state x (nq + nv), by the
// definitions of docs/interface.md section 2 and not by the residuals.
inline Eigen::VectorXd Measured(const Mechanism& mechanism,
                                const Channel& channel,
                                const Eigen::VectorXd& x) {
  if (channel.kind == ChannelKind::kFramePosition) {
    const Eigen::Vector3d p =
        LinkPoses(mechanism, x.head(mechanism.nq))[channel.target]
            .translation();
    return p(channel.axes);
  }
  const Joint& joint = mechanism.joints[channel.target];
  if (channel.kind == ChannelKind::kPosition ||
      channel.kind == ChannelKind::kOrientation) {
    return x.segment(joint.q_index, ConfigurationSize(joint.type));
  }
  return x.segment(mechanism.nq + joint.v_index, VelocitySize(joint.type));
}

// Channels without values: the position and the velocity of every moving joint,
// the last link's position in the world, and that of the one before as a camera
// sees it.
inline std::vector<Channel> EveryChannel(const Mechanism& mechanism) {
  std::vector<Channel> channels;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    if (joint.type == JointType::kFixed) continue;
    const bool ball = joint.type == JointType::kSpherical;
    Channel position, velocity;
    position.kind = ball ? ChannelKind::kOrientation : ChannelKind::kPosition;
    velocity.kind =
        ball ? ChannelKind::kAngularVelocity : ChannelKind::kVelocity;
    position.target = velocity.target = static_cast<int>(j);
    position.name = joint.name;
    velocity.name = joint.name + (ball ? ".w" : ".qd");
    channels.push_back(position);
    channels.push_back(velocity);
  }
  const int last = static_cast<int>(mechanism.links.size()) - 1;
  for (const int link : {last, last - 1}) {
    Channel frame;
    frame.kind = ChannelKind::kFramePosition;
    frame.target = link;
    frame.name = mechanism.links[link].name;
    frame.axes = link == last ? std::vector<int>{0, 1, 2} : std::vector{0, 2};
    channels.push_back(frame);
  }
  return channels;
}

// The states at each sample of a run's times and efforts, samples x state_size.
inline RowMatrixXd StatesOf(const Model& model, const Run& run,
                            const Eigen::VectorXd& x0,
                            const RolloutOptions& options = {}) {
  const ParameterMap nothing(model, {});
  Run bare = run;
  bare.channels.clear();
  const Measurements measurements{&bare, {}};
  const SegmentRollout rollout(&model, &nothing, &measurements, 0,
                               run.size() - 1, options);
  std::vector<double> x_end(x0.size()), visited;
  const double* no_theta = nullptr;
  double* no_errors = nullptr;
  EXPECT_TRUE(rollout(x0.data(), no_theta, no_errors, x_end.data(), &visited));
  return Eigen::Map<const RowMatrixXd>(visited.data(), run.size(), x0.size());
}

// A run of `samples` samples from x0 under random efforts, with every channel
// measured with the given noise. Sensor effects are not in it.
inline Run MeasureEverything(const Model& model, const Eigen::VectorXd& x0,
                             int samples, double period, double noise,
                             Random* random) {
  Run run;
  run.name = "random";
  for (int k = 0; k < samples; ++k) run.t.push_back(0.5 + period * k);
  run.effort.resize(samples, model.nv());
  for (double& effort : run.effort.reshaped()) effort = random->Normal();
  const RowMatrixXd states = StatesOf(model, run, x0);
  run.channels = EveryChannel(model.mechanism());
  for (Channel& channel : run.channels) {
    for (int k = 0; k < samples; ++k) {
      Eigen::VectorXd value =
          Measured(model.mechanism(), channel, states.row(k).transpose());
      value += noise * random->NormalVector(static_cast<int>(value.size()));
      if (channel.kind == ChannelKind::kOrientation) value.normalize();
      channel.values.conservativeResize(samples, value.size());
      channel.values.row(k) = value.transpose();
    }
  }
  return run;
}

inline Measurements MeasurementsOf(const Mechanism& mechanism, const Run& run,
                                   OrientationResidual orientation) {
  Measurements measurements{&run, {}};
  for (const Channel& channel : run.channels) {
    measurements.residuals.push_back(
        MakeChannelResidual(mechanism, channel, orientation));
  }
  return measurements;
}

}  // namespace sysid
