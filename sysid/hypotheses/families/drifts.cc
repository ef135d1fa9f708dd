// Zeros that wander: an encoder that loses counts, a gyro's integral.

#include <algorithm>
#include <cmath>

#include "sysid/hypotheses/families/families.h"
#include "sysid/io/run_columns.h"

namespace sysid {
namespace {

// Of a joint's position over the runs.
struct Trend {
  double slope = 0.0;    // mean
  double fastest = 0.0;  // the largest range over its duration
};

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

void DriftHypotheses(const CheckInput& input,
                     std::vector<DataHypothesis>* all) {
  const Mechanism& mechanism = input.model->mechanism();
  double longest = 0.0;
  for (const Run* run : input.runs) {
    longest = std::max(longest, run->t.back() - run->t.front());
  }
  for (const int j : MeasuredJoints(input)) {
    const bool turns = IsRotation1(mechanism.joints[j].type);
    const std::string column = mechanism.joints[j].name + ".q";
    const std::string unit = turns ? "rad/s" : "m/s";
    DataHypothesis hypothesis;
    hypothesis.fault = DataFault::kDrift;
    hypothesis.subjects = {column};
    hypothesis.probe = 1e-4;  // linear in it: anything above rounding
    hypothesis.least = 2e-4;  // a degree in 90 s
    const Trend trend = TrendOf(input, j);
    // Twice: a motion may go against its drift.
    hypothesis.most = std::max(hypothesis.least, 2.0 * trend.fastest);
    // Where the motion comes back to where it began, the drift itself; and of a
    // hinge, whose gravity is no line, parts of a radian over the recording.
    hypothesis.starts = {trend.slope};
    if (turns) {
      for (const double total : {-0.8, -0.3, 0.3, 0.8}) {
        hypothesis.starts.push_back(total / longest);
      }
    }
    hypothesis.corrected = [column](double rate) {
      return std::vector<CorrectedColumn>{
          {column, {{1.0, column}, {-rate, "t"}}}};
    };
    hypothesis.says = [=](double rate, double within) {
      return "with a zero of " + column + " that drifts by " +
             ShortNumber(rate) + " (+- " + ShortNumber(within) + ") " + unit;
    };
    hypothesis.consequence =
        "parameters fitted to its beginning do not hold at its end";
    all->push_back(hypothesis);
  }
}

}  // namespace sysid
