// A velocity column beside the position that it is the slope of.

#include <algorithm>
#include <cmath>
#include <optional>

#include "sysid/checks/excerpt.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/series.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

// Changes of the position over windows against the integrals of the velocity
// there, the velocity read `lag` seconds later than it stands.
struct Agreement {
  double slope = 0.0;  // dq = slope x integral
  double correlation = 0.0;
  double misfit = 0.0;  // of dq - slope x integral, over that of dq
};

Agreement Compare(const Series& q, const Series& qd, double lag,
                  double window) {
  const auto integral = [&](const std::vector<double>& t,
                            const std::vector<double>& v) {
    std::vector<double> sum(t.size(), 0.0);
    for (size_t k = 1; k < t.size(); ++k) {
      sum[k] = sum[k - 1] + 0.5 * (v[k] + v[k - 1]) * (t[k] - t[k - 1]);
    }
    return sum;
  };
  const std::vector<double> sum = integral(qd.t, qd.y);
  const auto value = [](const std::vector<double>& t,
                        const std::vector<double>& y, double at) {
    const auto next = std::upper_bound(t.begin(), t.end(), at);
    if (next == t.begin()) return y.front();
    if (next == t.end()) return y.back();
    const size_t k = next - t.begin();
    const double s = (at - t[k - 1]) / (t[k] - t[k - 1]);
    return y[k - 1] + s * (y[k] - y[k - 1]);
  };
  double xx = 0, xy = 0, yy = 0;
  const double margin = 0.06;
  for (double from = q.t.front() + margin; from + window < q.t.back() - margin;
       from += 0.5 * window) {
    const double dq = value(q.t, q.y, from + window) - value(q.t, q.y, from);
    const double dv =
        value(qd.t, sum, from + window + lag) - value(qd.t, sum, from + lag);
    xx += dv * dv;
    xy += dv * dq;
    yy += dq * dq;
  }
  if (!(xx > 0 && yy > 0)) return {};
  return {xy / xx, xy / std::sqrt(xx * yy), 1.0 - xy * xy / (xx * yy)};
}

}  // namespace

void CheckVelocities(const CheckInput& input, std::vector<Finding>* findings) {
  constexpr double kClear = 0.9;
  const std::vector<Series> all = AllSeries(input);
  for (const Series& qd : all) {
    if (qd.channel->kind != ChannelKind::kVelocity) continue;
    const Series* q = nullptr;
    for (const Series& other : all) {
      if (other.run == qd.run &&
          other.channel->kind == ChannelKind::kPosition &&
          other.channel->target == qd.channel->target) {
        q = &other;
      }
    }
    if (q == nullptr || !(q->range > 20 * q->noise)) continue;
    const double period = MedianPeriod(qd.run->t);
    const double window = std::max(0.1, 5 * period);
    const Agreement as_read = Compare(*q, qd, 0.0, window);
    const std::string source = SourceOf(input, qd.column);
    Finding finding = At(qd, "velocity_scale", Severity::kWrong);
    finding.weight = 1e3;  // sure: no model is asked
    finding.consequence =
        "position and velocity contradict each other: a fit can follow neither";
    const std::string slope = q->column + " changes by " +
                              ShortNumber(as_read.slope) + " times what " +
                              qd.column + " says (correlation " +
                              ShortNumber(as_read.correlation) + ")";
    if (std::abs(as_read.correlation) > kClear) {
      if (std::abs(as_read.slope + 1.0) < 0.15) {
        finding.fault = "velocity_flipped";
        finding.evidence = slope;
        finding.remedies = {
            ColumnsFlag(input, {{qd.column, Negated(source)}}),
            ColumnsFlag(input,
                        {{q->column, Negated(SourceOf(input, q->column))}})};
        findings->push_back(finding);
        continue;
      }
      if (std::abs(as_read.slope - 1.0) > 0.15) {
        finding.evidence = slope;
        finding.remedies = {ColumnsFlag(
            input, {{qd.column, Times(source, ShortNumber(as_read.slope))}})};
        findings->push_back(finding);
        continue;
      }
    } else {
      // Another joint's?
      for (const Series& other : all) {
        if (other.run != qd.run || &other == &qd ||
            other.channel->kind != ChannelKind::kVelocity) {
          continue;
        }
        const Agreement theirs = Compare(*q, other, 0.0, window);
        if (theirs.correlation < kClear || std::abs(theirs.slope - 1) > 0.15) {
          continue;
        }
        finding.fault = "velocities_swapped";
        finding.evidence = slope + ", but by " + ShortNumber(theirs.slope) +
                           " times what " + other.column +
                           " says (correlation " +
                           ShortNumber(theirs.correlation) + ")";
        finding.remedies = {
            ColumnsFlag(input, {{qd.column, SourceOf(input, other.column)},
                                {other.column, source}})};
        break;
      }
      if (finding.fault == "velocities_swapped") {
        findings->push_back(finding);
        continue;
      }
    }
    // Out of step: the lag at which they agree best.
    double best = 0.0, best_misfit = as_read.misfit;
    const double resolution = 0.5 * period;
    for (double lag = -0.05; lag <= 0.05; lag += resolution) {
      const Agreement there = Compare(*q, qd, lag, std::max(0.03, 3 * period));
      if (lag == -0.05 || there.misfit < best_misfit) {
        best = lag;
        best_misfit = there.misfit;
      }
    }
    const double still =
        Compare(*q, qd, 0.0, std::max(0.03, 3 * period)).misfit;
    if (std::abs(best) < std::max(1.5 * period, 0.006) ||
        !(best_misfit < 0.5 * still)) {
      continue;
    }
    finding.fault = "velocity_late";
    finding.evidence =
        qd.column + " agrees with " + q->column + " where it " + "is read " +
        ShortNumber(1e3 * std::abs(best)) +
        (best > 0 ? " ms earlier" : " ms later") + " (misfit of the changes " +
        ShortNumber(100 * std::sqrt(best_misfit)) + " % instead of " +
        ShortNumber(100 * std::sqrt(still)) + " %)";
    finding.remedies = {ShiftFlag(input, qd.column, best),
                        ShiftFlag(input, q->column, -best)};
    findings->push_back(finding);
  }
}

}  // namespace sysid
