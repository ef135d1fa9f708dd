// A clock that runs too fast or too slow.

#include <cmath>

#include "sysid/checks/edit_run.h"
#include "sysid/hypotheses/families/families.h"

namespace sysid {

// t was recorded exp(p) times too long. A mechanism that only swings then seems
// to feel a gravity of g exp(-2 p).
void ClockHypotheses(const CheckInput& input,
                     std::vector<DataHypothesis>* all) {
  DataHypothesis hypothesis;
  hypothesis.fault = DataFault::kClockScale;
  hypothesis.subjects = {"t"};
  hypothesis.probe = 1e-4;  // far above rounding, and linear there
  hypothesis.least = 0.03;  // lengths of a data sheet are no better than 6 %
  hypothesis.most = 1.5;
  hypothesis.starts = {-0.6, -0.3, -0.1, 0.1, 0.3, 0.6};
  hypothesis.like_bodies = true;
  hypothesis.change = [](double p, Run* run) {
    const double scale = std::exp(-p);
    for (double& t : run->t) t *= scale;
    for (Channel& channel : run->channels) {
      if (channel.kind == ChannelKind::kVelocity ||
          channel.kind == ChannelKind::kAngularVelocity) {
        channel.values /= scale;
      }
    }
  };
  hypothesis.log_unit = [](const Channel& channel, double p) {
    const bool is_velocity = channel.kind == ChannelKind::kVelocity ||
                             channel.kind == ChannelKind::kAngularVelocity;
    return is_velocity ? p : 0.0;
  };
  const double g = input.model->nominal().gravity;
  hypothesis.says = [g](double p, double within) {
    return "with times " + ShortNumber(std::exp(-p)) + " (+- " +
           ShortNumber(within * std::exp(-p)) + ") as long (or a gravity of " +
           ShortNumber(g * std::exp(-2 * p)) +
           " m/s^2: a wrong clock, or wrong lengths)";
  };
  hypothesis.consequence =
      "lengths, masses or frictions are fitted that make up for the clock";
  hypothesis.fix = [](const CheckInput& of_run, double p) {
    SuggestedFix fix;
    fix.columns = {
        {"t", Times(SourceOf(of_run, "t"), ShortNumber(std::exp(-p)))}};
    return fix;
  };
  all->push_back(hypothesis);
}

}  // namespace sysid
