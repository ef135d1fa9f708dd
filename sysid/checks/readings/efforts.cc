// Efforts that do no work on the motion, and those in other units.

#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {

void ReadIdleEfforts(const CheckInput& input, std::vector<Reading>* readings) {
  const Mechanism* mechanism = &input.model->mechanism();
  int driven = 0;
  const auto add = [&](std::vector<int> which, const std::string& subject,
                       const std::string& remedy) {
    Reading reading;
    reading.fault = "effort_idle";
    reading.subject = subject;
    reading.says = "without " + subject;
    reading.consequence =
        "what was recorded there is not what moved the mechanism";
    reading.change = [which](Run* run) {
      for (const int v : which) run->effort.col(v).setZero();
    };
    reading.remedies = {remedy};
    readings->push_back(reading);
  };
  std::vector<int> all;
  for (const Joint& joint : mechanism->joints) {
    if (!IsSimple(joint) || !IsDriven(input, joint)) continue;
    ++driven;
    all.push_back(joint.v_index);
    const std::string column = joint.name + ".tau";
    add({joint.v_index}, column,
        ColumnsFlag(input, {{column, Times(SourceOf(input, column), "1e-9")}}));
  }
  if (driven < 2) return;
  NewColumns columns;
  std::string names;
  for (const Joint& joint : mechanism->joints) {
    if (!IsSimple(joint) || !IsDriven(input, joint)) continue;
    const std::string column = joint.name + ".tau";
    names += (names.empty() ? "" : ", ") + column;
    columns.push_back({column, Times(SourceOf(input, column), "1e-9")});
  }
  add(all, names, ColumnsFlag(input, columns));
}

}  // namespace sysid
