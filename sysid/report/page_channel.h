#pragma once

#include <string>
#include <vector>

#include "residuals/channel_residual.h"

namespace sysid {

// A channel as the page draws it: the numbers of a curve each, in which an
// error looks like one.
class ShownChannel {
 public:
  ShownChannel(const Mechanism& mechanism, const Channel& channel,
               OrientationResidual orientation);

  const std::string& kind() const { return kind_; }  // as page_data.ts has it
  const std::string& unit() const { return unit_; }
  const std::vector<std::string>& components() const { return components_; }

  // samples x components. An orientation is the heading of the link's axis, or
  // its rotation vector where that is what is compared.
  const RowMatrixXd& measured() const { return measured_; }
  // The same of predictions (rows as Channel::values has them), as near to the
  // measurement as their meaning allows. Rows that are NaN stay so.
  RowMatrixXd Predicted(const RowMatrixXd& values) const;
  // Measured less predicted, SI; of rotations that of the angle between.
  RowMatrixXd Difference(const RowMatrixXd& values) const;

 private:
  RowMatrixXd Show(const RowMatrixXd& values, const RowMatrixXd* near) const;

  const Channel& channel_;
  OrientationResidual orientation_;
  Eigen::Vector3d axis_;  // of the link
  bool turns_ = false;    // an angle about a fixed axis
  std::string kind_, unit_;
  std::vector<std::string> components_;
  RowMatrixXd measured_;
};

}  // namespace sysid
