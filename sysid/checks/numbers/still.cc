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

// Whether something moves in each window of a run.
std::vector<bool> FindMotion(const std::vector<Series>& of_run, double begin,
                             double window, int windows) {
  std::vector<bool> moves(windows, false);
  for (const Series& series : of_run) {
    std::vector<double> low(windows, INFINITY), high(windows, -INFINITY);
    for (size_t k = 0; k < series.y.size(); ++k) {
      const int w = std::min<int>(windows - 1, (series.t[k] - begin) / window);
      low[w] = std::min(low[w], series.y[k]);
      high[w] = std::max(high[w], series.y[k]);
    }
    const double least = std::max(kMoves * series.noise, 2e-3 * series.range);
    for (int w = 0; w < windows; ++w) {
      if (high[w] - low[w] > least) moves[w] = true;
    }
  }
  return moves;
}

// [first, last) of the longest stretch of windows in which nothing moves.
std::pair<int, int> LongestRest(const std::vector<bool>& moves) {
  std::pair<int, int> longest{0, 0};
  int first = 0;
  for (int w = 0; w < static_cast<int>(moves.size()); ++w) {
    if (moves[w]) first = w + 1;
    if (w + 1 - first > longest.second - longest.first) {
      longest = {first, w + 1};
    }
  }
  return longest;
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
    const std::vector<bool> moves = FindMotion(of_run, begin, window, windows);
    const int still = std::count(moves.begin(), moves.end(), false);
    if (still <= kMost * windows) continue;
    const auto [first, last] = LongestRest(moves);
    Finding finding;
    finding.fault = "still";
    finding.severity = Severity::kHarmful;
    finding.file = run->name;
    finding.t_start = begin + first * window;
    finding.t_end = begin + last * window;
    finding.weight = 100.0 * still / windows;
    finding.evidence = "nothing moves in " +
                       ShortNumber(100.0 * still / windows) + " % of " +
                       ShortNumber(duration) + " s, longest for " +
                       ShortNumber((last - first) * window) + " s";
    finding.consequence =
        "what stands still tells of dry friction alone, and weighs in the "
        "error as if it were predicted";
    std::string column;  // the four of a quaternion are one
    for (const Series& series : of_run) {
      if (series.column == column) continue;
      column = series.column;
      finding.remedies.push_back(IgnoreFlag(
          input, run->name, column, {{finding.t_start, finding.t_end}}));
    }
    findings->push_back(finding);
  }
}

}  // namespace sysid
