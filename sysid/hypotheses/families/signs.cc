// A column whose sign is the other way round than the axis of the URDF.

#include "sysid/checks/edit_run.h"
#include "sysid/hypotheses/families/families.h"

namespace sysid {

void SignHypotheses(const CheckInput& input, std::vector<DataHypothesis>* all) {
  const Mechanism* mechanism = &input.model->mechanism();
  const auto add = [&](DataFault fault, const std::vector<int>& joints,
                       int parts, const std::vector<std::string>& subjects,
                       const std::string& says) {
    DataHypothesis hypothesis;
    hypothesis.fault = fault;
    hypothesis.subjects = subjects;
    hypothesis.change = [=](double, Run* run) {
      for (const int j : joints) ScaleJoint(*mechanism, j, parts, -1.0, run);
    };
    hypothesis.says = Words(says);
    hypothesis.consequence =
        "as it stands the model moves the wrong way there: what is fitted "
        "makes up for that";
    hypothesis.fix = [=](const CheckInput& of_run, double) {
      SuggestedFix fix;
      for (const int j : joints) {
        std::vector<std::string> columns;
        if (parts & kMotion) columns = MotionColumns(of_run, j);
        if (parts & kEffort) {
          columns.push_back(mechanism->joints[j].name + ".tau");
        }
        for (const std::string& column : columns) {
          fix.columns.push_back({column, Negated(SourceOf(of_run, column))});
        }
      }
      return fix;
    };
    all->push_back(hypothesis);
  };
  const std::vector<int> driven = DrivenJoints(input);
  std::vector<std::string> efforts;
  for (const int j : MeasuredJoints(input)) {
    const std::string& name = mechanism->joints[j].name;
    add(DataFault::kAxisFlipped, {j}, kMotion, {name + ".q"},
        "with the sign of " + name + "'s motion changed");
  }
  for (const int j : driven) {
    const std::string& name = mechanism->joints[j].name;
    efforts.push_back(name + ".tau");
    add(DataFault::kEffortFlipped, {j}, kEffort, {name + ".tau"},
        "with the sign of " + name + "'s effort changed");
    if (Measures(input, ChannelKind::kPosition, j)) {
      add(DataFault::kAxisFlipped, {j}, kMotion | kEffort, {name},
          "with the axis of " + name + " the other way round");
    }
  }
  if (driven.size() > 1) {
    add(DataFault::kEffortFlipped, driven, kEffort, efforts,
        "with the sign of every effort changed");
  }
}

}  // namespace sysid
