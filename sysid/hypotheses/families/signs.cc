// A column whose sign is the other way round than the axis of the URDF.

#include "sysid/hypotheses/families/families.h"

namespace sysid {

void SignHypotheses(const CheckInput& input, std::vector<DataHypothesis>* all) {
  const Mechanism* mechanism = &input.model->mechanism();
  const auto add = [&](DataFault fault, const std::vector<std::string>& columns,
                       const std::vector<std::string>& subjects,
                       const std::string& says) {
    DataHypothesis hypothesis;
    hypothesis.fault = fault;
    hypothesis.subjects = subjects;
    hypothesis.corrected = [columns](double) { return Scaled(columns, -1.0); };
    hypothesis.says = Words(says);
    hypothesis.consequence =
        "with this sign the model moves in the wrong direction, and the fitted "
        "parameters compensate for it";
    all->push_back(hypothesis);
  };
  const std::vector<int> driven = DrivenJoints(input);
  std::vector<std::string> efforts, positions, motions;
  for (const int j : MeasuredJoints(input)) {
    const std::string& name = mechanism->joints[j].name;
    positions.push_back(name + ".q");
    for (const std::string& column : MotionColumns(name)) {
      motions.push_back(column);
    }
    add(DataFault::kAxisFlipped, MotionColumns(name), {name + ".q"},
        "with the sign of " + name + "'s motion changed");
  }
  for (const int j : driven) {
    const std::string& name = mechanism->joints[j].name;
    efforts.push_back(name + ".tau");
    add(DataFault::kEffortFlipped, {name + ".tau"}, {name + ".tau"},
        "with the sign of " + name + "'s effort changed");
    if (Measures(input, ChannelKind::kPosition, j)) {
      add(DataFault::kAxisFlipped, {name + ".q", name + ".qd", name + ".tau"},
          {name}, "with the axis of " + name + " the other way round");
    }
  }
  if (driven.size() > 1) {
    add(DataFault::kEffortFlipped, efforts, efforts,
        "with the sign of every effort changed");
  }
  // Of a machine that is its own mirror image the same as all efforts, which is
  // the commoner mistake.
  if (positions.size() > 1) {
    add(DataFault::kAxisFlipped, motions, positions,
        "with the sign of every motion changed");
  }
}

}  // namespace sysid
