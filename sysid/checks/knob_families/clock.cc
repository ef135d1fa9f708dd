// A clock that runs too fast or too slow.

#include <cmath>

#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {

// t was recorded exp(value) times too long. A mechanism that only swings then
// seems to feel a gravity of g exp(-2 value).
void FindClock(const CheckInput& input, std::vector<Knob>* knobs) {
  Knob knob;
  knob.fault = "clock_scale";
  knob.subject = "t";
  knob.probe = 1e-4;
  knob.least = 0.08;
  knob.most = 1.5;
  knob.starts = {-0.5, -0.2, 0.2, 0.5};
  knob.gain = 3.0;
  knob.of_model = 1.3;
  knob.change = [](double value, Run* run) {
    const double scale = std::exp(-value);
    for (double& t : run->t) t *= scale;
    for (Channel& channel : run->channels) {
      if (channel.kind == ChannelKind::kVelocity ||
          channel.kind == ChannelKind::kAngularVelocity) {
        channel.values /= scale;
      }
    }
  };
  const double g = input.model->nominal().gravity;
  knob.says = [g](double value, double within) {
    return "with times " + ShortNumber(std::exp(-value)) + " (+- " +
           ShortNumber(within * std::exp(-value)) +
           ") as long (or a gravity of " +
           ShortNumber(g * std::exp(-2 * value)) +
           " m/s^2: a wrong clock, or wrong lengths)";
  };
  knob.consequence =
      "lengths, masses or frictions are fitted that make up for the clock";
  knob.remedies = [input](double value) {
    return std::vector<std::string>{ColumnsFlag(
        input,
        {{"t", Times(SourceOf(input, "t"), ShortNumber(std::exp(-value)))}})};
  };
  knobs->push_back(knob);
}

}  // namespace sysid
