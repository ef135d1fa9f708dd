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
  double as_is = 1.0;   // of dq - integral
};

Agreement Compare(const Series& q, const Series& qd, double lag,
                  double window) {
  std::vector<double> sum(qd.t.size(), 0.0);  // the integral
  for (size_t k = 1; k < sum.size(); ++k) {
    sum[k] =
        sum[k - 1] + 0.5 * (qd.y[k] + qd.y[k - 1]) * (qd.t[k] - qd.t[k - 1]);
  }
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
  const double margin = std::max(0.06, window);
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
  return {xy / xx, xy / std::sqrt(xx * yy), 1.0 - xy * xy / (xx * yy),
          (yy - 2 * xy + xx) / yy};
}

// Of one joint, in one run.
struct Pair {
  const Series *q = nullptr, *qd = nullptr;
};

std::vector<Pair> FindPairs(const std::vector<Series>& all) {
  std::vector<Pair> pairs;
  for (const Series& qd : all) {
    if (qd.channel->kind != ChannelKind::kVelocity) continue;
    for (const Series& q : all) {
      if (q.run == qd.run && q.channel->kind == ChannelKind::kPosition &&
          q.channel->target == qd.channel->target && q.range > 20 * q.noise) {
        pairs.push_back({&q, &qd});
      }
    }
  }
  return pairs;
}

double Window(const Pair& pair) {
  return std::max(0.1, 5 * MedianPeriod(pair.qd->run->t));
}

Finding Of(const Pair& pair, const std::string& fault) {
  Finding finding = At(*pair.qd, fault, Severity::kWrong);
  finding.weight = 1e3;  // sure: no model is asked
  finding.consequence =
      "position and velocity contradict each other: a fit can follow neither";
  return finding;
}

std::string Changes(const Pair& pair, const Agreement& as_read) {
  return "changes of " + pair.q->column + " are " + ShortNumber(as_read.slope) +
         " times the integral of " + pair.qd->column + " (correlation " +
         ShortNumber(as_read.correlation) + ")";
}

constexpr double kClear = 0.9;   // correlation
constexpr double kClose = 0.15;  // of a slope to one

// Another joint's? Joints that move alike agree crosswise and, by some factor,
// as they are read: what leaves less is the better explanation, and a velocity
// that is right for its own joint is not another's.
std::optional<Finding> FindSwapped(const CheckInput& input,
                                   const std::vector<Pair>& pairs,
                                   const Pair& pair) {
  constexpr double kBetter = 0.25;
  const Agreement as_read = Compare(*pair.q, *pair.qd, 0.0, Window(pair));
  for (const Pair& other : pairs) {
    if (other.qd->run != pair.qd->run || other.qd == pair.qd) continue;
    const Agreement theirs = Compare(*pair.q, *other.qd, 0.0, Window(pair));
    if (theirs.correlation < kClear || std::abs(theirs.slope - 1) > kClose ||
        theirs.as_is > kBetter * as_read.misfit ||
        theirs.as_is > Compare(*other.q, *other.qd, 0.0, Window(pair)).as_is) {
      continue;
    }
    Finding finding = Of(pair, "velocities_swapped");
    finding.evidence = Changes(pair, as_read) + ", but " +
                       ShortNumber(theirs.slope) + " times that of " +
                       other.qd->column + " (correlation " +
                       ShortNumber(theirs.correlation) + ")";
    finding.remedies = {ColumnsFlag(
        input, {{pair.qd->column, SourceOf(input, other.qd->column)},
                {other.qd->column, SourceOf(input, pair.qd->column)}})};
    return finding;
  }
  return std::nullopt;
}

// The other way round, or in another unit.
std::optional<Finding> FindScaled(const CheckInput& input, const Pair& pair) {
  const Agreement as_read = Compare(*pair.q, *pair.qd, 0.0, Window(pair));
  if (std::abs(as_read.correlation) < kClear ||
      std::abs(as_read.slope - 1.0) < kClose) {
    return std::nullopt;
  }
  const std::string& q = pair.q->column;
  const std::string& qd = pair.qd->column;
  const std::string source = SourceOf(input, qd);
  Finding finding = Of(pair, "velocity_scale");
  finding.evidence = Changes(pair, as_read);
  finding.remedies = {
      ColumnsFlag(input, {{qd, Times(source, ShortNumber(as_read.slope))}})};
  if (std::abs(as_read.slope + 1.0) < kClose) {
    finding.fault = "velocity_flipped";
    finding.remedies = {ColumnsFlag(input, {{qd, Negated(source)}}),
                        ColumnsFlag(input, {{q, Negated(SourceOf(input, q))}})};
  }
  return finding;
}

// Out of step: the lag at which they agree best.
std::optional<Finding> FindLate(const CheckInput& input, const Pair& pair) {
  const double period = MedianPeriod(pair.qd->run->t);
  const double window = std::max(0.03, 3 * period);
  const double resolution = 0.5 * period;
  const int most = static_cast<int>(std::max(0.05, 2 * period) / resolution);
  const double still = Compare(*pair.q, *pair.qd, 0.0, window).misfit;
  double best = 0.0, misfit = still;
  for (int i = -most; i <= most; ++i) {
    const double lag = i * resolution;
    const Agreement there = Compare(*pair.q, *pair.qd, lag, window);
    if (there.misfit >= misfit) continue;
    best = lag;
    misfit = there.misfit;
  }
  // A slope over a few samples is half a sample late or early at most.
  if (std::abs(best) < std::max(0.9 * period, 0.006) ||
      !(misfit < 0.5 * still)) {
    return std::nullopt;
  }
  const std::string& q = pair.q->column;
  const std::string& qd = pair.qd->column;
  Finding finding = Of(pair, "velocity_late");
  finding.evidence = qd + " agrees with " + q + " where it is read " +
                     ShortNumber(1e3 * std::abs(best)) +
                     (best > 0 ? " ms earlier" : " ms later") +
                     " (misfit of the changes " +
                     ShortNumber(100 * std::sqrt(misfit)) + " % instead of " +
                     ShortNumber(100 * std::sqrt(still)) + " %)";
  finding.remedies = {ShiftFlag(input, {qd}, best),
                      ShiftFlag(input, {q}, -best)};
  return finding;
}

}  // namespace

void CheckVelocities(const CheckInput& input, std::vector<Finding>* findings) {
  const std::vector<Series> all = AllSeries(input);
  const std::vector<Pair> pairs = FindPairs(all);
  for (const Pair& pair : pairs) {
    std::optional<Finding> finding = FindSwapped(input, pairs, pair);
    if (!finding) finding = FindScaled(input, pair);
    if (!finding) finding = FindLate(input, pair);
    if (finding) findings->push_back(*finding);
  }
}

}  // namespace sysid
