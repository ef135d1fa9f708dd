#include "sysid/hypotheses/families/families.h"

namespace sysid {

std::vector<int> MeasuredJoints(const CheckInput& input) {
  std::vector<int> joints;
  const Mechanism& mechanism = input.model->mechanism();
  for (int j = 0; j < static_cast<int>(mechanism.joints.size()); ++j) {
    if (VelocitySize(mechanism.joints[j]) == 1 &&
        Measures(input, ChannelKind::kPosition, j)) {
      joints.push_back(j);
    }
  }
  return joints;
}

std::vector<int> DrivenJoints(const CheckInput& input) {
  std::vector<int> joints;
  const Mechanism& mechanism = input.model->mechanism();
  for (int j = 0; j < static_cast<int>(mechanism.joints.size()); ++j) {
    if (VelocitySize(mechanism.joints[j]) == 1 &&
        IsDriven(input, mechanism.joints[j])) {
      joints.push_back(j);
    }
  }
  return joints;
}

std::vector<std::string> MotionColumns(const std::string& joint) {
  return {joint + ".q", joint + ".qd"};
}

std::vector<CorrectedColumn> Scaled(const std::vector<std::string>& columns,
                                    double factor) {
  std::vector<CorrectedColumn> scaled;
  for (const std::string& column : columns) {
    scaled.push_back({column, {{factor, column}}});
  }
  return scaled;
}

std::function<std::string(double, double)> Words(const std::string& text) {
  return [text](double, double) { return text; };
}

}  // namespace sysid
