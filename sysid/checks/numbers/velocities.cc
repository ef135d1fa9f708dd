// A velocity column beside the position that it is the slope of.

#include <algorithm>
#include <cmath>
#include <optional>

#include "sysid/checks/column_fault.h"
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

ColumnFault Of(const Pair& pair, const std::string& name) {
  ColumnFault fault;
  fault.finding.fault = name;
  fault.finding.severity = Severity::kWrong;
  fault.finding.weight = 1e3;  // sure: no model is asked
  fault.finding.consequence =
      "position and velocity contradict each other: a fit can follow neither";
  fault.run = pair.qd->run;
  fault.columns = {pair.qd->column};
  return fault;
}

// A column by an expression of what it is read from.
ColumnFix Reads(const std::string& column,
                std::function<std::string(const std::string&)> expression) {
  return {column, column, std::move(expression)};
}

std::function<std::string(const std::string&)> Factor(double factor) {
  return [factor](const std::string& source) {
    return Times(source, ShortNumber(factor));
  };
}

std::string Changes(const Pair& pair, const Agreement& as_read) {
  return "changes of " + pair.q->column + " are " + ShortNumber(as_read.slope) +
         " times the integral of " + pair.qd->column + " (correlation " +
         ShortNumber(as_read.correlation) + ")";
}

constexpr double kClear = 0.9;   // correlation
constexpr double kClose = 0.15;  // of a slope to one
constexpr double kLatest = 0.1;  // s: as late as hypotheses of delays look
// s: a fiftieth of a sample at 200 Hz; nearer no parabola through noise tells.
constexpr double kGrain = 1e-4;

// Another joint's? Joints that move alike agree crosswise and, by some factor,
// as they are read: what leaves less is the better explanation, and a velocity
// that is right for its own joint is not another's.
std::optional<ColumnFault> FindSwapped(const std::vector<Pair>& pairs,
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
    ColumnFault fault = Of(pair, "velocities_swapped");
    fault.finding.evidence = Changes(pair, as_read) + ", but " +
                             ShortNumber(theirs.slope) + " times that of " +
                             other.qd->column + " (correlation " +
                             ShortNumber(theirs.correlation) + ")";
    const std::string& mine = pair.qd->column;
    const std::string& its = other.qd->column;
    const auto as_it_is = [](const std::string& source) { return source; };
    fault.columns.push_back(its);
    fault.fixes = {{{mine, its, as_it_is}, {its, mine, as_it_is}}};
    return fault;
  }
  return std::nullopt;
}

// The other way round, or in another unit.
std::optional<ColumnFault> FindScaled(const Pair& pair) {
  const Agreement as_read = Compare(*pair.q, *pair.qd, 0.0, Window(pair));
  if (std::abs(as_read.correlation) < kClear ||
      std::abs(as_read.slope - 1.0) < kClose) {
    return std::nullopt;
  }
  const std::string& q = pair.q->column;
  const std::string& qd = pair.qd->column;
  ColumnFault fault = Of(pair, "velocity_scale");
  fault.finding.evidence = Changes(pair, as_read);
  fault.size = as_read.slope;
  if (std::abs(as_read.slope + 1.0) < kClose) {
    fault.finding.fault = "velocity_flipped";
    fault.fixes = {{Reads(qd, Negated)}, {Reads(q, Negated)}};
    return fault;
  }
  fault.fixes = {{Reads(qd, Factor(as_read.slope))},
                 {Reads(q, Factor(1.0 / as_read.slope))}};
  return fault;
}

// Out of step: the lag at which they agree best.
std::optional<ColumnFault> FindLate(const Pair& pair) {
  const double period = MedianPeriod(pair.qd->run->t);
  const double window = std::max(0.03, 3 * period);
  const double resolution = 0.5 * period;
  const int most = static_cast<int>(std::max(kLatest, 2 * period) / resolution);
  const auto misfit_at = [&](double lag) {
    return Compare(*pair.q, *pair.qd, lag, window).misfit;
  };
  const double still = misfit_at(0.0);
  double best = 0.0, misfit = still;
  for (int i = -most; i <= most; ++i) {
    const double lag = i * resolution;
    const double there = misfit_at(lag);
    if (there >= misfit) continue;
    best = lag;
    misfit = there;
  }
  // A slope over a few samples is half a sample late or early at most.
  if (std::abs(best) < std::max(0.9 * period, 0.006) ||
      !(misfit < 0.5 * still)) {
    return std::nullopt;
  }
  // The least of the parabola through the least and its neighbours.
  const double before = misfit_at(best - resolution);
  const double after = misfit_at(best + resolution);
  const double bend = before - 2.0 * misfit + after;
  if (bend > 0.0) {
    best += std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) * resolution;
    best = kGrain * std::round(best / kGrain);
  }
  const std::string& q = pair.q->column;
  const std::string& qd = pair.qd->column;
  ColumnFault fault = Of(pair, "velocity_late");
  fault.finding.evidence =
      qd + " agrees with " + q + " where it is read " +
      ShortNumber(1e3 * std::abs(best)) +
      (best > 0 ? " ms earlier" : " ms later") + " (misfit of the changes " +
      ShortNumber(100 * std::sqrt(misfit)) + " % instead of " +
      ShortNumber(100 * std::sqrt(still)) + " %)";
  fault.size = best;
  fault.fixes = {{{qd, qd, nullptr, best}}, {{q, q, nullptr, -best}}};
  return fault;
}

}  // namespace

void CheckVelocities(const CheckInput& input, std::vector<Finding>* findings) {
  const std::vector<Series> all = AllSeries(input);
  const std::vector<Pair> pairs = FindPairs(all);
  std::vector<ColumnFault> faults;
  for (const Pair& pair : pairs) {
    std::optional<ColumnFault> fault = FindSwapped(pairs, pair);
    if (!fault) fault = FindScaled(pair);
    if (!fault) fault = FindLate(pair);
    if (!fault) continue;
    // Of two that are exchanged the other has told it already.
    const bool is_told =
        std::any_of(faults.begin(), faults.end(), [&](const ColumnFault& f) {
          return f.finding.fault == fault->finding.fault &&
                 f.run == fault->run &&
                 std::is_permutation(f.columns.begin(), f.columns.end(),
                                     fault->columns.begin(),
                                     fault->columns.end());
        });
    if (!is_told) faults.push_back(std::move(*fault));
  }
  // Where every velocity of a run contradicts by one factor, its clock may be
  // what is wrong.
  for (ColumnFault& fault : faults) {
    if (fault.finding.fault != "velocity_scale" || fault.size < 0.0) continue;
    const auto in_run = std::count_if(
        pairs.begin(), pairs.end(),
        [&](const Pair& pair) { return pair.qd->run == fault.run; });
    const auto alike = std::count_if(
        faults.begin(), faults.end(), [&](const ColumnFault& other) {
          return other.run == fault.run && IsAlike(other, fault);
        });
    if (alike == in_run) {
      fault.fixes.push_back({Reads("t", Factor(fault.size))});
    }
  }
  AddTogether(input, std::move(faults), findings);
}

}  // namespace sysid
