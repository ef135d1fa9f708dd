#include "sysid/report/page_channel.h"

#include <cmath>
#include <tuple>
#include <utility>

#include "models/math/constants.h"
#include "models/math/rotation.h"

namespace sysid {
namespace {

Eigen::Quaterniond ToQuaternion(const Eigen::RowVectorXd& row) {
  return {row[3], row[0], row[1], row[2]};
}

// Of the rotation vectors of one rotation the nearest to another vector.
Eigen::Vector3d NearestTurn(const Eigen::Vector3d& phi,
                            const Eigen::Vector3d& to) {
  const double angle = phi.norm();
  if (!(angle > 0)) return phi;
  const Eigen::Vector3d direction = phi / angle;
  const double turns = std::round((to.dot(direction) - angle) / (2 * M_PI));
  return (angle + 2 * M_PI * turns) * direction;
}

}  // namespace

ShownChannel::ShownChannel(const Mechanism& mechanism, const Channel& channel,
                           OrientationResidual orientation)
    : channel_(channel),
      orientation_(orientation),
      unit_(ResidualUnit(mechanism, channel)) {
  // By kind, in the order of ChannelKind.
  static const std::pair<const char*, std::vector<std::string>> kShown[] = {
      {"position", {"q"}},
      {"velocity", {"qd"}},
      {"rotation", {"r_x", "r_y", "r_z"}},
      {"angular_velocity", {"wx", "wy", "wz"}},
      {"frame_position", {"px", "py", "pz"}},
      {"motor_position", {"motor_q"}}};
  std::tie(kind_, components_) = kShown[static_cast<int>(channel.kind)];
  if (channel.kind == ChannelKind::kFramePosition) {
    std::vector<std::string> measured;
    for (const int axis : channel.axes) measured.push_back(components_[axis]);
    components_ = std::move(measured);
  }
  turns_ = IsScalarPosition(channel.kind) &&
           IsRotation1(mechanism.joints[channel.target].type);
  if (channel.kind == ChannelKind::kOrientation) {
    axis_ = LinkAxis(mechanism, mechanism.joints[channel.target].child_link);
    if (orientation == OrientationResidual::kHeading) {
      components_ = {"z_x", "z_y", "z_z"};
      unit_ = "-";
    }
  }
  measured_ = Show(channel.values, nullptr);
}

RowMatrixXd ShownChannel::Show(const RowMatrixXd& values,
                               const RowMatrixXd* near) const {
  if (channel_.kind != ChannelKind::kOrientation) return values;
  RowMatrixXd shown(values.rows(), 3);
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  for (int k = 0; k < values.rows(); ++k) {
    if (!values.row(k).allFinite()) {
      shown.row(k).setConstant(kNaN);
    } else if (orientation_ == OrientationResidual::kHeading) {
      shown.row(k) =
          (ToMatrix(ToQuaternion(values.row(k))) * axis_).transpose();
    } else {
      if (near != nullptr && near->row(k).allFinite()) {
        last = near->row(k).transpose();
      }
      last = NearestTurn(Log(ToQuaternion(values.row(k))), last);
      shown.row(k) = last.transpose();
    }
  }
  return shown;
}

RowMatrixXd ShownChannel::Predicted(const RowMatrixXd& values) const {
  RowMatrixXd shown = Show(values, &measured_);
  if (!turns_) return shown;
  double turns = 0.0;  // goes on where nothing was measured
  for (int k = 0; k < shown.rows(); ++k) {
    const double off = (measured_(k, 0) - shown(k, 0)) / (2 * M_PI);
    if (std::isfinite(off)) turns = std::round(off);
    shown(k, 0) += 2 * M_PI * turns;
  }
  return shown;
}

RowMatrixXd ShownChannel::Difference(const RowMatrixXd& values) const {
  if (channel_.kind != ChannelKind::kOrientation ||
      orientation_ == OrientationResidual::kHeading) {
    return measured_ - Predicted(values);
  }
  RowMatrixXd difference(values.rows(), 3);
  for (int k = 0; k < values.rows(); ++k) {
    const Eigen::RowVectorXd measured = channel_.values.row(k);
    if (!measured.allFinite() || !values.row(k).allFinite()) {
      difference.row(k).setConstant(kNaN);
      continue;
    }
    const Eigen::Quaterniond from = ToQuaternion(values.row(k)).conjugate();
    difference.row(k) =
        Log(Eigen::Quaterniond(from * ToQuaternion(measured))).transpose();
  }
  return difference;
}

}  // namespace sysid
