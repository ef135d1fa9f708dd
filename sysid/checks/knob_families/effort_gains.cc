// Efforts in another unit, or of another gear ratio.

#include <cmath>

#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {

// tau was recorded exp(value) times too large. Bodies that are all exp(-value)
// times as heavy as they should be do the same.
void FindEffortGains(const CheckInput& input, std::vector<Knob>* knobs) {
  const auto add = [&](const std::vector<const Joint*>& joints) {
    Knob knob;
    knob.fault = "effort_scale";
    for (const Joint* joint : joints) {
      knob.subject += (knob.subject.empty() ? "" : ", ") + joint->name + ".tau";
    }
    knob.probe = 1e-4;
    // Less than that is a body's or a drive's constant, to be fitted.
    knob.least = std::log(2.0);
    knob.most = std::log(2e3);
    for (const double factor : {1e-3, 1e-2, 0.1, 0.4, 2.5, 10.0, 100.0, 1e3}) {
      knob.starts.push_back(std::log(factor));
    }
    knob.gain = 3.0;
    knob.of_model = 3.0;  // real machines lack effects beside
    std::vector<int> columns;
    for (const Joint* joint : joints) columns.push_back(joint->v_index);
    knob.change = [columns](double value, Run* run) {
      for (const int v : columns) run->effort.col(v) *= std::exp(-value);
    };
    const std::string subject = knob.subject;
    knob.says = [subject](double value, double within) {
      const double factor = std::exp(-value);
      return "with " + subject + " times " + ShortNumber(factor) + " (+- " +
             ShortNumber(within * factor) +
             "; another unit or gear ratio, or bodies that are " +
             ShortNumber(factor > 1.0 ? factor : 1.0 / factor) + " times too " +
             (factor > 1.0 ? "heavy" : "light") + ")";
    };
    knob.consequence =
        "masses, frictions and springs are fitted in its unit, not in theirs";
    knob.remedies = [input, joints](double value) {
      const std::string factor = ShortNumber(std::exp(-value));
      NewColumns scaled;
      for (const Joint* joint : joints) {
        const std::string column = joint->name + ".tau";
        scaled.push_back({column, Times(SourceOf(input, column), factor)});
      }
      return std::vector<std::string>{ColumnsFlag(input, scaled)};
    };
    knobs->push_back(knob);
  };
  std::vector<const Joint*> driven;
  for (const Joint& joint : input.model->mechanism().joints) {
    if (IsSimple(joint) && IsDriven(input, joint)) driven.push_back(&joint);
  }
  for (const Joint* joint : driven) add({joint});
  if (driven.size() > 1) add(driven);
}

}  // namespace sysid
