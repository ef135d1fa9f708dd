// Zeros that wander: an encoder that loses counts, a gyro's integral.

#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/shipped_checks.h"
#include "sysid/io/csv.h"

namespace sysid {

void FindDrifts(const CheckInput& input, std::vector<Knob>* knobs) {
  const Mechanism& mechanism = input.model->mechanism();
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const int index = static_cast<int>(j);
    if (!IsSimple(mechanism.joints[j]) ||
        !Measures(input, ChannelKind::kPosition, index)) {
      continue;
    }
    const std::string column = mechanism.joints[j].name + ".q";
    Knob knob;
    knob.fault = "drift";
    knob.subject = column;
    knob.unit = IsRotation1(mechanism.joints[j].type) ? "rad/s" : "m/s";
    knob.probe = 1e-4;
    knob.least = 2e-4;
    knob.most = 1.0;
    knob.change = [index](double rate, Run* run) {
      Channel* channel = ChannelOf(run, ChannelKind::kPosition, index);
      if (channel == nullptr) return;
      for (int k = 0; k < run->size(); ++k) {
        channel->values(k, 0) -= rate * run->t[k];
      }
    };
    const std::string unit = knob.unit;
    knob.says = [=](double rate) {
      return "with a zero of " + column + " that drifts by " +
             ShortNumber(rate) + " " + unit;
    };
    knob.consequence =
        "what is fitted to its beginning does not hold at its end";
    knob.remedies = [=](double rate) {
      const std::string drift =
          Times(SourceOf(input, "t"), ShortNumber(std::abs(rate)));
      return std::vector<std::string>{ColumnsFlag(
          input, {{column,
                   SourceOf(input, column) + (rate > 0 ? "-" : "+") + drift}})};
    };
    knobs->push_back(knob);
  }
}

}  // namespace sysid
