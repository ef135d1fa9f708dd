// Columns of one joint under the name of another.

#include "sysid/hypotheses/families/families.h"

namespace sysid {

void OrderHypotheses(const CheckInput& input,
                     std::vector<DataHypothesis>* all) {
  const Mechanism* mechanism = &input.model->mechanism();
  const std::vector<int> joints = MeasuredJoints(input);
  std::vector<int> balls;
  for (int j = 0; j < static_cast<int>(mechanism->joints.size()); ++j) {
    if (Measures(input, ChannelKind::kOrientation, j)) balls.push_back(j);
  }
  const auto add = [&](DataFault fault, int a, int b,
                       const std::vector<std::string>& suffixes,
                       const std::string& what) {
    const std::string first = mechanism->joints[a].name,
                      second = mechanism->joints[b].name;
    DataHypothesis hypothesis;
    hypothesis.fault = fault;
    hypothesis.subjects = {first, second};
    hypothesis.corrected = [=](double) {
      std::vector<CorrectedColumn> columns;
      for (const std::string& suffix : suffixes) {
        columns.push_back({first + suffix, {{1.0, second + suffix}}});
        columns.push_back({second + suffix, {{1.0, first + suffix}}});
      }
      return columns;
    };
    hypothesis.says = Words("with " + what + " of " + first + " and " + second +
                            " exchanged");
    hypothesis.consequence =
        "each joint is fitted to the data of another joint";
    all->push_back(hypothesis);
  };
  for (size_t i = 0; i < balls.size(); ++i) {
    for (size_t k = i + 1; k < balls.size(); ++k) {
      add(DataFault::kJointsSwapped, balls[i], balls[k],
          {".qw", ".qx", ".qy", ".qz", ".wx", ".wy", ".wz"}, "the columns");
    }
  }
  for (size_t i = 0; i < joints.size(); ++i) {
    for (size_t k = i + 1; k < joints.size(); ++k) {
      const int a = joints[i], b = joints[k];
      const bool driven = IsDriven(input, mechanism->joints[a]) ||
                          IsDriven(input, mechanism->joints[b]);
      add(DataFault::kJointsSwapped, a, b, {".q", ".qd"},
          driven ? "the motions" : "the columns");
      if (!driven) continue;
      add(DataFault::kEffortsSwapped, a, b, {".tau"}, "the efforts");
      add(DataFault::kJointsSwapped, a, b, {".q", ".qd", ".tau"},
          "all columns");
    }
  }
}

}  // namespace sysid
