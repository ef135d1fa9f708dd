// Zeros that wander: an encoder that loses counts, a gyro's integral.

#include <algorithm>
#include <cmath>

#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/shipped_checks.h"
#include "sysid/io/csv.h"

namespace sysid {
namespace {

struct Trend {
  double slope = 0.0;    // the mean of all runs
  double fastest = 0.0;  // the largest range over its duration
};

// Of a joint's position: the drift itself where a motion comes back to where it
// began.
Trend TrendOf(const CheckInput& input, int joint) {
  Trend trend;
  for (const Run* run : input.runs) {
    const Channel* channel = FindChannel(*run, ChannelKind::kPosition, joint);
    if (channel == nullptr) continue;
    const double middle = 0.5 * (run->t.front() + run->t.back());
    double tt = 0.0, tq = 0.0, low = INFINITY, high = -INFINITY;
    for (int k = 0; k < run->size(); ++k) {
      const double t = run->t[k] - middle, q = channel->values(k, 0);
      if (std::isnan(q)) continue;
      tt += t * t;
      tq += t * q;
      low = std::min(low, q);
      high = std::max(high, q);
    }
    if (!(tt > 0.0)) continue;
    trend.slope += tq / tt / static_cast<double>(input.runs.size());
    trend.fastest = std::max(trend.fastest,
                             (high - low) / (run->t.back() - run->t.front()));
  }
  return trend;
}

}  // namespace

void FindDrifts(const CheckInput& input, std::vector<Knob>* knobs) {
  const Mechanism& mechanism = input.model->mechanism();
  double longest = 0.0;
  for (const Run* run : input.runs) {
    longest = std::max(longest, run->t.back() - run->t.front());
  }
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
    knob.probe = 1e-4;
    knob.least = 2e-4;
    const Trend trend = TrendOf(input, index);
    // Twice: a motion may go against its drift.
    knob.most = std::max(knob.least, 2.0 * trend.fastest);
    knob.starts = {trend.slope};
    if (IsRotation1(mechanism.joints[j].type)) {
      for (const double total : {-0.8, -0.3, 0.3, 0.8}) {  // rad
        knob.starts.push_back(total / longest);
      }
    }
    knob.change = [index](double rate, Run* run) {
      Channel* channel = ChannelOf(run, ChannelKind::kPosition, index);
      if (channel == nullptr) return;
      for (int k = 0; k < run->size(); ++k) {
        channel->values(k, 0) -= rate * run->t[k];
      }
    };
    const std::string unit =
        IsRotation1(mechanism.joints[j].type) ? "rad/s" : "m/s";
    knob.says = [=](double rate, double within) {
      return "with a zero of " + column + " that drifts by " +
             ShortNumber(rate) + " (+- " + ShortNumber(within) + ") " + unit;
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
