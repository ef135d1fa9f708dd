// A motion that turns faster than it was sampled.

#include <algorithm>
#include <cmath>

#include "sysid/checks/excerpt.h"
#include "sysid/checks/series.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

// Velocities turn as often as positions, and have other noise.
bool IsRate(ChannelKind kind) {
  return kind == ChannelKind::kVelocity ||
         kind == ChannelKind::kAngularVelocity;
}

// Steps that no sensor's noise makes: a column at rest turns at every second
// sample, whatever its rate.
double LeastStep(const CheckInput& input, const Series& series) {
  constexpr double kAngle = 0.05;   // rad
  constexpr double kLength = 0.01;  // m
  const Channel& channel = *series.channel;
  const bool is_length =
      channel.kind == ChannelKind::kFramePosition ||
      (IsScalarPosition(channel.kind) &&
       input.model->mechanism().joints[channel.target].type ==
           JointType::kPrismatic);
  return std::max(0.1 * series.range, is_length ? kLength : kAngle);
}

// How often a series turns, a sample.
double TurnsPerSample(const Series& series, double least) {
  int steps = 0, turns = 0, direction = 0;
  for (size_t k = 1; k < series.y.size(); ++k) {
    const double step = series.y[k] - series.y[k - 1];
    if (std::abs(step) < least) continue;
    const int now = step > 0 ? 1 : -1;
    ++steps;
    turns += direction != 0 && now != direction;
    direction = now;
  }
  return steps < 8 ? 0.0 : static_cast<double>(turns) / series.y.size();
}

// Half turns a sample of a hinge that goes round and round.
double HalfTurnsPerSample(const CheckInput& input, const Series& series) {
  const Channel& channel = *series.channel;
  if (!IsScalarPosition(channel.kind) ||
      !IsRotation1(input.model->mechanism().joints[channel.target].type)) {
    return 0.0;
  }
  return std::abs(series.y.back() - series.y.front()) / M_PI / series.y.size();
}

}  // namespace

void CheckRates(const CheckInput& input, std::vector<Finding>* findings) {
  constexpr double kTurns = 1.0 / 3.0;  // a sample: six samples a swing
  std::string last;                     // the four of a quaternion are one
  for (const Series& series : MotionSeries(input)) {
    if (IsRate(series.channel->kind)) continue;
    const double turns = TurnsPerSample(series, LeastStep(input, series));
    const double rounds = HalfTurnsPerSample(input, series);
    const double part = std::max(turns, rounds);
    if (part < kTurns || series.run->name + series.column == last) continue;
    last = series.run->name + series.column;
    Finding finding = At(series, kSlowSampling, Severity::kHarmful);
    finding.weight = part;
    const double period = MedianPeriod(series.run->t);
    finding.evidence = (turns >= rounds ? "it turns back every "
                                        : "it goes half round every ") +
                       ShortNumber(1.0 / part) + " samples, " +
                       ShortNumber(period) + " s apart";
    finding.consequence =
        "with so few samples per period the motion between samples is "
        "undetermined";
    finding.remedies = {"record at " + ShortNumber(10 * part / period / 2) +
                        " Hz or more"};
    findings->push_back(finding);
  }
}

}  // namespace sysid
