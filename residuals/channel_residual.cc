#include "residuals/channel_residual.h"

#include <algorithm>

#include "glog/logging.h"

namespace sysid {
namespace {

template <int kNumbers>
ChannelResidual FrameResidual(const Channel& channel) {
  FramePositionResidual<kNumbers> residual{channel.target, {}};
  std::copy_n(channel.axes.begin(), kNumbers, residual.axes.begin());
  return residual;
}

ChannelResidual OfScalarPosition(const Joint& joint, SensedAt at) {
  if (joint.type == JointType::kPrismatic) {
    return PositionResidual{joint.q_index, at};
  }
  return PlanarHeadingResidual{joint.q_index, at};
}

}  // namespace

ChannelResidual MakeChannelResidual(const Mechanism& mechanism,
                                    const Channel& channel,
                                    OrientationResidual orientation) {
  if (channel.kind == ChannelKind::kFramePosition) {
    switch (channel.axes.size()) {
      case 1:
        return FrameResidual<1>(channel);
      case 2:
        return FrameResidual<2>(channel);
      default:
        return FrameResidual<3>(channel);
    }
  }
  const Joint& joint = mechanism.joints[channel.target];
  switch (channel.kind) {
    case ChannelKind::kPosition:
      return OfScalarPosition(joint, SensedAt::kJoint);
    case ChannelKind::kMotorPosition:
      return OfScalarPosition(joint, SensedAt::kMotor);
    case ChannelKind::kOrientation:
      if (orientation == OrientationResidual::kRotation) {
        return RotationResidual{joint.q_index};
      }
      return HeadingResidual{joint.q_index,
                             LinkAxis(mechanism, joint.child_link)};
    case ChannelKind::kVelocity:
      return VelocityResidual{joint.v_index};
    case ChannelKind::kAngularVelocity:
      return AngularVelocityResidual{joint.v_index};
    case ChannelKind::kFramePosition:
      break;
  }
  LOG(FATAL) << "not a channel kind";
  return VelocityResidual{0};
}

int ResidualSize(const ChannelResidual& residual) {
  return std::visit([](const auto& r) { return r.kSize; }, residual);
}

int ResidualDof(const ChannelResidual& residual) {
  return std::visit([](const auto& r) { return r.kDof; }, residual);
}

std::string ResidualUnit(const Mechanism& mechanism, const Channel& channel) {
  if (channel.kind == ChannelKind::kFramePosition) return "m";
  const bool slide =
      mechanism.joints[channel.target].type == JointType::kPrismatic;
  const std::string length = slide ? "m" : "rad";
  return IsPositionLike(channel.kind) ? length : length + "/s";
}

bool IsPositionLike(ChannelKind kind) {
  return IsScalarPosition(kind) || kind == ChannelKind::kOrientation ||
         kind == ChannelKind::kFramePosition;
}

}  // namespace sysid
