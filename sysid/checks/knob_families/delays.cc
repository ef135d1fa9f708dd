// Channels that were recorded late or early beside the others.

#include <algorithm>

#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {

void FindDelays(const CheckInput& input, std::vector<Knob>* knobs) {
  const Mechanism* mechanism = &input.model->mechanism();
  double period = INFINITY;
  for (const Run* run : input.runs) {
    period = std::min(period, MedianPeriod(run->t));
  }
  const auto add = [&](const std::string& subject,
                       const std::vector<std::string>& columns) {
    Knob knob;
    knob.fault = "channel_late";
    knob.subject = subject;
    knob.probe = 0.5 * period;
    // Half a sample is how well times are known at all; below 2 ms what a
    // drive's electronics do is an effect of the machine (effort_delay).
    knob.least = std::max(0.5 * period, 0.002);
    knob.most = 0.1;
    // A motion that turns within it is beyond what the linearisation sees.
    if (!columns.front().ends_with(".tau") || columns.size() > 1) {
      knob.starts = {-0.025, -0.008, 0.008, 0.025};
    }
    // An effort that acts late is the machine's as often as the recording's:
    // a real drive gained 1.6 (docs/checks.md).
    knob.gain = columns.front().ends_with(".tau") ? 1.8 : 1.15;
    knob.change = [=](double delay, Run* run) {
      ChannelEdits edits;
      for (const std::string& column : columns) {
        edits.shifts.push_back({column, delay, "check"});
      }
      ApplyEdits(edits, *mechanism, run, nullptr);
    };
    knob.grain = period;
    knob.says = [=](double delay, double within) {
      return "with " + subject + " read " + ShortNumber(1e3 * std::abs(delay)) +
             " ms (+- " + ShortNumber(1e3 * within) + " ms) " +
             (delay > 0 ? "earlier" : "later");
    };
    knob.consequence =
        "a lag between columns passes for damping, and bends what is fitted";
    knob.remedies = [=](double delay) {
      return std::vector<std::string>{ShiftFlag(input, columns, delay)};
    };
    knobs->push_back(knob);
  };
  std::vector<std::string> efforts;
  int measured = 0;
  for (const Joint& joint : mechanism->joints) {
    if (IsSimple(joint) && IsDriven(input, joint)) {
      efforts.push_back(joint.name + ".tau");
    }
  }
  const int joints = static_cast<int>(mechanism->joints.size());
  for (int j = 0; j < joints; ++j) {
    measured += Measures(input, ChannelKind::kPosition, j) ||
                Measures(input, ChannelKind::kOrientation, j);
  }
  // One channel alone is early or late beside nothing.
  if (measured + efforts.size() < 2) return;
  for (int j = 0; j < joints; ++j) {
    const std::string& name = mechanism->joints[j].name;
    if (Measures(input, ChannelKind::kPosition, j)) {
      add(name + ".q", {name + ".q"});
    } else if (Measures(input, ChannelKind::kOrientation, j)) {
      add(name + ".qw", {name + ".qw"});
    }
  }
  for (const std::string& effort : efforts) add(effort, {effort});
  if (efforts.size() > 1) {
    std::string names;
    for (const std::string& effort : efforts) {
      names += (names.empty() ? "" : ", ") + effort;
    }
    add(names, efforts);
  }
}

}  // namespace sysid
