// Efforts in another unit or of another gear ratio, and efforts without
// influence on the motion.

#include <algorithm>
#include <cmath>

#include "sysid/checks/edit_run.h"
#include "sysid/hypotheses/families/families.h"

namespace sysid {
namespace {

SuggestedFix Scaled(const CheckInput& of_run,
                    const std::vector<std::string>& columns,
                    const std::string& factor) {
  SuggestedFix fix;
  for (const std::string& column : columns) {
    fix.columns.push_back({column, Times(SourceOf(of_run, column), factor)});
  }
  return fix;
}

// tau was recorded exp(p) times too large. Bodies that are all exp(-p) times as
// heavy do the same.
DataHypothesis Gain(const std::vector<int>& columns,
                    const std::vector<std::string>& names) {
  DataHypothesis hypothesis;
  hypothesis.fault = DataFault::kEffortScale;
  hypothesis.subjects = names;
  hypothesis.like_bodies = true;
  hypothesis.probe = 1e-4;  // far above rounding, and linear there
  // Less than a factor of 2 is a body's or a drive's constant, to be fitted;
  // N mm for N m is 1000.
  hypothesis.least = std::log(2.0);
  hypothesis.most = std::log(2e3);
  for (const double factor : {1e-3, 1e-2, 0.1, 0.4, 2.5, 10.0, 100.0, 1e3}) {
    hypothesis.starts.push_back(std::log(factor));
  }
  hypothesis.change = [columns](double p, Run* run) {
    for (const int v : columns) run->effort.col(v) *= std::exp(-p);
  };
  hypothesis.log_effort = [columns](int v, double p) {
    return std::find(columns.begin(), columns.end(), v) == columns.end() ? 0.0
                                                                         : -p;
  };
  const std::string subject = hypothesis.subject();
  hypothesis.says = [subject](double p, double within) {
    const double factor = std::exp(-p);
    return "with " + subject + " times " + ShortNumber(factor) + " (+- " +
           ShortNumber(within * factor) +
           "; another unit or gear ratio, or bodies that are " +
           ShortNumber(factor > 1.0 ? factor : 1.0 / factor) + " times too " +
           (factor > 1.0 ? "heavy" : "light") + ")";
  };
  hypothesis.consequence =
      "masses, frictions and springs are fitted in its unit, not in theirs";
  hypothesis.fix = [names](const CheckInput& of_run, double p) {
    return Scaled(of_run, names, ShortNumber(std::exp(-p)));
  };
  return hypothesis;
}

DataHypothesis WithoutInfluence(int v, const std::string& column) {
  DataHypothesis hypothesis;
  hypothesis.fault = DataFault::kEffortIdle;
  hypothesis.subjects = {column};
  hypothesis.change = [v](double, Run* run) { run->effort.col(v).setZero(); };
  hypothesis.says = Words("without " + column);
  hypothesis.consequence =
      "what was recorded there is not what moved the mechanism";
  hypothesis.fix = [column](const CheckInput& of_run, double) {
    return Scaled(of_run, {column}, "1e-9");
  };
  return hypothesis;
}

}  // namespace

void EffortHypotheses(const CheckInput& input,
                      std::vector<DataHypothesis>* all) {
  const Mechanism& mechanism = input.model->mechanism();
  std::vector<int> columns;
  std::vector<std::string> names;
  for (const int j : DrivenJoints(input)) {
    columns.push_back(mechanism.joints[j].v_index);
    names.push_back(mechanism.joints[j].name + ".tau");
    all->push_back(Gain({columns.back()}, {names.back()}));
  }
  if (columns.size() > 1) all->push_back(Gain(columns, names));
  for (size_t i = 0; i < columns.size(); ++i) {
    all->push_back(WithoutInfluence(columns[i], names[i]));
  }
}

}  // namespace sysid
