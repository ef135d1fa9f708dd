// Columns of one joint under the name of another.

#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {

void ReadSwappedJoints(const CheckInput& input,
                       std::vector<Reading>* readings) {
  const Mechanism* mechanism = &input.model->mechanism();
  const int count = static_cast<int>(mechanism->joints.size());
  const auto usable = [&](int j) {
    return IsSimple(mechanism->joints[j]) &&
           Measures(input, ChannelKind::kPosition, j);
  };
  for (int a = 0; a < count; ++a) {
    for (int b = a + 1; b < count; ++b) {
      if (!usable(a) || !usable(b)) continue;
      const Joint &first = mechanism->joints[a], &second = mechanism->joints[b];
      const bool driven = IsDriven(input, first) || IsDriven(input, second);
      const auto add = [&](int parts, const std::string& fault,
                           const std::string& what) {
        NewColumns columns;
        const auto swap = [&](const std::string& suffix) {
          columns.push_back(
              {first.name + suffix, SourceOf(input, second.name + suffix)});
          columns.push_back(
              {second.name + suffix, SourceOf(input, first.name + suffix)});
        };
        if (parts & kMotion) swap(".q");
        if ((parts & kMotion) && Measures(input, ChannelKind::kVelocity, a) &&
            Measures(input, ChannelKind::kVelocity, b)) {
          swap(".qd");
        }
        if (parts & kEffort) swap(".tau");
        Reading reading;
        reading.fault = fault;
        reading.subject = first.name + ", " + second.name;
        reading.says = "with " + what + " of " + first.name + " and " +
                       second.name + " exchanged";
        reading.consequence =
            "as it stands each joint is fitted to what another one did";
        reading.change = [=](Run* run) {
          SwapJoints(*mechanism, a, b, parts, run);
        };
        reading.remedies = {ColumnsFlag(input, columns)};
        readings->push_back(reading);
      };
      add(kMotion, "joints_swapped", driven ? "the motions" : "the columns");
      if (!driven) continue;
      add(kEffort, "efforts_swapped", "the efforts");
      add(kMotion | kEffort, "joints_swapped", "all columns");
    }
  }
}

}  // namespace sysid
