// Columns of one joint under the name of another.

#include "sysid/checks/edit_run.h"
#include "sysid/hypotheses/families/families.h"

namespace sysid {

void OrderHypotheses(const CheckInput& input,
                     std::vector<DataHypothesis>* all) {
  const Mechanism* mechanism = &input.model->mechanism();
  const std::vector<int> joints = MeasuredJoints(input);
  const auto add = [&](DataFault fault, int a, int b, int parts,
                       const std::string& what) {
    const std::string first = mechanism->joints[a].name,
                      second = mechanism->joints[b].name;
    DataHypothesis hypothesis;
    hypothesis.fault = fault;
    hypothesis.subjects = {first, second};
    hypothesis.change = [=](double, Run* run) {
      SwapJoints(*mechanism, a, b, parts, run);
    };
    hypothesis.says = Words("with " + what + " of " + first + " and " + second +
                            " exchanged");
    hypothesis.consequence =
        "as it stands each joint is fitted to what another one did";
    hypothesis.fix = [=](const CheckInput& of_run, double) {
      SuggestedFix fix;
      const auto swap = [&](const std::string& suffix) {
        fix.columns.push_back(
            {first + suffix, SourceOf(of_run, second + suffix)});
        fix.columns.push_back(
            {second + suffix, SourceOf(of_run, first + suffix)});
      };
      if (parts & kMotion) {
        swap(".q");
        if (Measures(of_run, ChannelKind::kVelocity, a) &&
            Measures(of_run, ChannelKind::kVelocity, b)) {
          swap(".qd");
        }
      }
      if (parts & kEffort) swap(".tau");
      return fix;
    };
    all->push_back(hypothesis);
  };
  for (size_t i = 0; i < joints.size(); ++i) {
    for (size_t k = i + 1; k < joints.size(); ++k) {
      const int a = joints[i], b = joints[k];
      const bool driven = IsDriven(input, mechanism->joints[a]) ||
                          IsDriven(input, mechanism->joints[b]);
      add(DataFault::kJointsSwapped, a, b, kMotion,
          driven ? "the motions" : "the columns");
      if (!driven) continue;
      add(DataFault::kEffortsSwapped, a, b, kEffort, "the efforts");
      add(DataFault::kJointsSwapped, a, b, kMotion | kEffort, "all columns");
    }
  }
}

}  // namespace sysid
