#include "sysid/hypotheses/families/families.h"

#include "sysid/checks/edit_run.h"

namespace sysid {

std::vector<int> MeasuredJoints(const CheckInput& input) {
  std::vector<int> joints;
  const Mechanism& mechanism = input.model->mechanism();
  for (int j = 0; j < static_cast<int>(mechanism.joints.size()); ++j) {
    if (IsSimple(mechanism.joints[j]) &&
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
    if (IsSimple(mechanism.joints[j]) && IsDriven(input, mechanism.joints[j])) {
      joints.push_back(j);
    }
  }
  return joints;
}

std::vector<std::string> MotionColumns(const CheckInput& input, int joint) {
  const std::string& name = input.model->mechanism().joints[joint].name;
  std::vector<std::string> columns = {name + ".q"};
  if (Measures(input, ChannelKind::kVelocity, joint)) {
    columns.push_back(name + ".qd");
  }
  return columns;
}

std::function<std::string(double, double)> Words(const std::string& text) {
  return [text](double, double) { return text; };
}

}  // namespace sysid
