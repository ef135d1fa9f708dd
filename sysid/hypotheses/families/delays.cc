// Columns that were recorded late or early beside the others.

#include <algorithm>
#include <cmath>

#include "sysid/checks/excerpt.h"
#include "sysid/hypotheses/families/families.h"

namespace sysid {

void DelayHypotheses(const CheckInput& input,
                     std::vector<DataHypothesis>* all) {
  const Mechanism* mechanism = &input.model->mechanism();
  double period = INFINITY;
  for (const Run* run : input.runs) {
    period = std::min(period, MedianPeriod(run->t));
  }
  const auto add = [&](const std::vector<std::string>& columns) {
    DataHypothesis hypothesis;
    hypothesis.fault = DataFault::kChannelLate;
    hypothesis.subjects = hypothesis.late = columns;
    hypothesis.is_effect = true;
    // Where half a sample changes the residuals, and rounding does not.
    hypothesis.probe = 0.5 * period;
    // Half a sample is how well times are known at all; what a drive's
    // electronics do below 2 ms is an effect of the machine (effort_delay).
    hypothesis.least = std::max(0.5 * period, 0.002);
    hypothesis.most = 0.1;  // s: twice what an excerpt's windows keep aside
    hypothesis.grain = period;
    // Between these the residuals are nearly linear in the delay of a motion
    // of some Hz.
    hypothesis.starts = {-0.03, -0.015, 0.015, 0.03};
    const std::string subject = hypothesis.subject();
    hypothesis.says = [subject](double delay, double within) {
      return "with " + subject + " read " + ShortNumber(1e3 * std::abs(delay)) +
             " ms (+- " + ShortNumber(1e3 * within) + " ms) " +
             (delay > 0 ? "earlier" : "later");
    };
    hypothesis.consequence =
        "a lag between columns acts like damping and biases the parameters";
    all->push_back(hypothesis);
  };
  std::vector<std::string> efforts;
  std::vector<std::vector<std::string>> sensors;  // the columns of each
  for (const int j : DrivenJoints(input)) {
    efforts.push_back(mechanism->joints[j].name + ".tau");
  }
  for (size_t j = 0; j < mechanism->joints.size(); ++j) {
    const std::string& name = mechanism->joints[j].name;
    if (Measures(input, ChannelKind::kPosition, static_cast<int>(j))) {
      // A velocity is of the same sensor: a lag of one of the two alone the
      // numbers show (CheckVelocities).
      sensors.push_back({name + ".q"});
      if (Measures(input, ChannelKind::kVelocity, static_cast<int>(j))) {
        sensors.back().push_back(name + ".qd");
      }
    } else if (Measures(input, ChannelKind::kOrientation,
                        static_cast<int>(j))) {
      sensors.push_back({name + ".qw"});
    }
    if (Measures(input, ChannelKind::kMotorPosition, static_cast<int>(j))) {
      sensors.push_back({name + ".motor_q"});
    }
  }
  // One alone is early or late beside nothing.
  if (sensors.size() + efforts.size() < 2) return;
  for (const std::vector<std::string>& columns : sensors) add(columns);
  for (const std::string& effort : efforts) add({effort});
  if (efforts.size() > 1) add(efforts);
}

}  // namespace sysid
