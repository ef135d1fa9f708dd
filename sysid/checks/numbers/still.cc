// Recordings of which most stands still.

#include <algorithm>
#include <cmath>

#include "sysid/checks/excerpt.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/series.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

constexpr double kMost = 0.6;     // of a recording
constexpr double kWindow = 0.25;  // s
constexpr int kSamples = 5;       // of a window
constexpr double kMoves = 6.0;    // times the noise, within a window

std::vector<Series> OfRun(const CheckInput& input, const Run* run) {
  std::vector<Series> of_run = MotionSeries(input);
  std::erase_if(of_run, [&](const Series& series) {
    return series.run != run || series.channel->kind == ChannelKind::kVelocity;
  });
  return of_run;
}

// What was seen of each window of a run.
enum class Seen { kNothing, kRest, kMotion };

std::vector<Seen> FindMotion(const std::vector<Series>& of_run, double begin,
                             double window, int windows) {
  std::vector<Seen> seen(windows, Seen::kNothing);
  for (const Series& series : of_run) {
    std::vector<double> low(windows, INFINITY), high(windows, -INFINITY);
    for (size_t k = 0; k < series.y.size(); ++k) {
      const int w = std::min<int>(windows - 1, (series.t[k] - begin) / window);
      low[w] = std::min(low[w], series.y[k]);
      high[w] = std::max(high[w], series.y[k]);
    }
    const double least = std::max(kMoves * series.noise, 2e-3 * series.range);
    for (int w = 0; w < windows; ++w) {
      if (high[w] - low[w] > least) {
        seen[w] = Seen::kMotion;
      } else if (high[w] >= low[w] && seen[w] == Seen::kNothing) {
        seen[w] = Seen::kRest;
      }
    }
  }
  return seen;
}

// [first, last) of the stretches of windows at rest, the longest first.
std::vector<std::pair<int, int>> Rests(const std::vector<Seen>& seen) {
  std::vector<std::pair<int, int>> rests;
  for (int w = 0; w < static_cast<int>(seen.size()); ++w) {
    if (seen[w] != Seen::kRest) continue;
    if (rests.empty() || rests.back().second != w) rests.push_back({w, w});
    rests.back().second = w + 1;
  }
  std::stable_sort(rests.begin(), rests.end(), [](auto a, auto b) {
    return a.second - a.first > b.second - b.first;
  });
  return rests;
}

// Too few samples a swing look like noise, and a motion within the noise like
// rest: then nothing is said of it.
bool IsTooRough(const std::vector<Series>& of_run, double period) {
  constexpr double kSmooth = 20.0;  // times the noise
  return kSamples * period > kWindow &&
         std::any_of(of_run.begin(), of_run.end(), [](const Series& series) {
           return series.range < kSmooth * series.noise;
         });
}

}  // namespace

void CheckStill(const CheckInput& input, std::vector<Finding>* findings) {
  for (const Run* run : input.runs) {
    const std::vector<Series> of_run = OfRun(input, run);
    if (of_run.empty()) continue;
    const double period = MedianPeriod(run->t);
    if (IsTooRough(of_run, period)) continue;
    const double window = std::max(kWindow, kSamples * period);
    const double begin = run->t.front(), duration = run->t.back() - begin;
    const int windows = static_cast<int>(duration / window);
    if (windows < 8) continue;
    const std::vector<Seen> seen = FindMotion(of_run, begin, window, windows);
    const auto count = [&](Seen what) {
      return static_cast<int>(std::count(seen.begin(), seen.end(), what));
    };
    const int still = count(Seen::kRest);
    const int looked_at = still + count(Seen::kMotion);
    if (still <= kMost * looked_at) continue;
    std::vector<std::pair<int, int>> rests = Rests(seen);
    const std::pair<int, int> longest = rests.front();
    const auto [first, last] = longest;
    Finding finding = At(*run, "", "still", Severity::kHarmful);
    finding.t_start = begin + first * window;
    finding.t_end = begin + last * window;
    finding.weight = 100.0 * still / looked_at;
    finding.evidence = "nothing moves in " +
                       ShortNumber(100.0 * still / looked_at) + " % of " +
                       ShortNumber(looked_at * window) + " s, longest for " +
                       ShortNumber((last - first) * window) + " s";
    finding.consequence =
        "rest is informative about dry friction only, but counts in the error "
        "as correctly predicted";
    // All columns together, for they are still together.
    constexpr double kWorthIt = 1.0;  // s
    std::erase_if(rests, [&](const auto& rest) {
      return rest != longest && (rest.second - rest.first) * window < kWorthIt;
    });
    // A window more at each end: somewhere in it the rest began or ended, and
    // what was held still there no model follows.
    std::sort(rests.begin(), rests.end());
    std::vector<std::pair<double, double>> spans;
    for (const auto& [from, to] : rests) {
      const double start = begin + std::max(0, from - 1) * window;
      const double end = std::min(begin + (to + 1) * window, run->t.back());
      if (spans.empty() || spans.back().second < start) {
        spans.push_back({start, end});
      } else {
        spans.back().second = end;
      }
    }
    std::vector<std::string> columns;
    for (const Series& series : MotionSeries(input)) {
      // Velocities too; the four of a quaternion are one.
      if (series.run == run &&
          (columns.empty() || columns.back() != series.column)) {
        columns.push_back(series.column);
      }
    }
    finding.remedies = {IgnoreFlag(input, run->name, columns, spans)};
    findings->push_back(finding);
  }
}

}  // namespace sysid
