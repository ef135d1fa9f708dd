// Values that stand still while the mechanism does not: a sensor at its end, a
// channel that hangs or drops out. And recordings of which most stands still.

#include <algorithm>
#include <cmath>

#include "sysid/checks/remedy.h"
#include "sysid/checks/series.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

struct Plateau {
  int first, last;     // samples of one and the same value
  double entry, exit;  // mean step over the samples before, behind
  double jump_in, jump_out;
};

// Stretches of at least `least` samples that are equal to the last digit.
std::vector<Plateau> FindPlateaus(const Series& series, int least) {
  constexpr int kSlope = 4;  // samples
  const std::vector<double>& y = series.y;
  const int n = static_cast<int>(y.size());
  std::vector<Plateau> plateaus;
  for (int first = 0; first < n;) {
    int last = first;
    while (last + 1 < n && y[last + 1] == y[first]) ++last;
    if (last - first + 1 >= least) {
      const int before = std::max(0, first - kSlope);
      const int behind = std::min(n - 1, last + kSlope);
      Plateau p{first, last, 0, 0, 0, 0};
      if (first - before >= 2) {
        p.entry = std::abs(y[first - 1] - y[before]) / (first - 1 - before);
        p.jump_in = std::abs(y[first] - y[first - 1]);
      }
      if (behind - last >= 2) {
        p.exit = std::abs(y[behind] - y[last + 1]) / (behind - last - 1);
        p.jump_out = std::abs(y[last + 1] - y[last]);
      }
      plateaus.push_back(p);
    }
    first = last + 1;
  }
  return plateaus;
}

void Report(const CheckInput& input, const Series& series,
            const std::vector<std::pair<int, int>>& spans,
            const std::string& fault, const std::string& what,
            const std::string& consequence, std::vector<Finding>* findings) {
  int samples = 0;
  for (const auto& [first, last] : spans) samples += last - first + 1;
  Finding finding = At(series, fault, Severity::kWrong);
  finding.weight = 1e3 * samples / series.y.size();
  finding.t_start = series.t[spans.front().first];
  finding.t_end = series.t[spans.back().second];
  finding.evidence = what + ", " + std::to_string(spans.size()) +
                     (spans.size() == 1 ? " time" : " times") + ", " +
                     std::to_string(samples) + " of " +
                     std::to_string(series.y.size()) + " samples";
  finding.consequence = consequence;
  finding.remedies = {IgnoreFlag(input, series.run->name, series.column,
                                 Times(series.t, spans))};
  findings->push_back(finding);
}

}  // namespace

void CheckSaturation(const CheckInput& input, std::vector<Finding>* findings) {
  constexpr int kLeast = 8;  // samples: a rounded swing turns within fewer
  for (const Series& series : AllSeries(input)) {
    const auto [low, high] =
        std::minmax_element(series.y.begin(), series.y.end());
    std::vector<std::pair<int, int>> spans;
    double level = 0.0;
    bool clipped = false;
    for (const Plateau& p : FindPlateaus(series, kLeast)) {
      const double value = series.y[p.first];
      if (value != *low && value != *high) continue;
      // A swing that turns comes to its end slowly: v = 0 there. It is cut off
      // where it runs into the end at a good part of its speed.
      const bool runs_in = std::max(p.entry, p.exit) > 0.3 * series.step &&
                           p.jump_in <= 3 * series.step &&
                           p.jump_out <= 3 * series.step;
      clipped = clipped || runs_in;
      level = runs_in ? value : level;
      spans.push_back({p.first, p.last});
    }
    if (!clipped) continue;
    std::erase_if(spans,
                  [&](const auto& s) { return series.y[s.first] != level; });
    Report(input, series, spans, "saturation",
           "it runs into " + ShortNumber(level) + " and stays there exactly",
           "the motion went on where the sensor ends: what is fitted is too "
           "slow and too small",
           findings);
  }
}

void CheckFrozen(const CheckInput& input, std::vector<Finding>* findings) {
  constexpr int kLeast = 4;  // samples
  for (const Series& series : AllSeries(input)) {
    std::vector<std::pair<int, int>> spans;
    const double jump = std::max(3.0 * series.step, 12.0 * series.noise);
    for (const Plateau& p : FindPlateaus(series, kLeast)) {
      if (p.jump_out > jump || p.jump_in > jump) {
        spans.push_back({p.first + (p.jump_in > jump ? 0 : 1), p.last});
      }
    }
    if (spans.empty() || spans.size() > 50) continue;
    Report(input, series, spans, "frozen",
           "it stands at " + ShortNumber(series.y[spans.front().first]) +
               " exactly and then jumps to where the motion is",
           "a channel that hung or dropped out: the motion went on", findings);
  }
}

void CheckStill(const CheckInput& input, std::vector<Finding>* findings) {
  constexpr double kMost = 0.6;     // of a recording
  constexpr double kWindow = 0.25;  // s
  constexpr double kMoves = 6.0;    // times the noise, within a window
  for (const Run* run : input.runs) {
    std::vector<Series> of_run;
    for (Series& series : AllSeries(input)) {
      if (series.run == run && series.channel->kind != ChannelKind::kVelocity) {
        of_run.push_back(std::move(series));
      }
    }
    if (of_run.empty()) continue;
    const double duration = run->t.back() - run->t.front();
    const int windows = static_cast<int>(duration / kWindow);
    if (windows < 8) continue;
    std::vector<bool> moves(windows, false);
    for (const Series& series : of_run) {
      std::vector<double> low(windows, INFINITY), high(windows, -INFINITY);
      for (size_t k = 0; k < series.y.size(); ++k) {
        const int w = std::min<int>(windows - 1,
                                    (series.t[k] - run->t.front()) / kWindow);
        low[w] = std::min(low[w], series.y[k]);
        high[w] = std::max(high[w], series.y[k]);
      }
      const double least = std::max(kMoves * series.noise, 2e-3 * series.range);
      for (int w = 0; w < windows; ++w) {
        if (high[w] - low[w] > least) moves[w] = true;
      }
    }
    const int still = std::count(moves.begin(), moves.end(), false);
    if (still <= kMost * windows) continue;
    // The longest stretch.
    int best = 0, best_end = 0, length = 0;
    for (int w = 0; w < windows; ++w) {
      length = moves[w] ? 0 : length + 1;
      if (length > best) {
        best = length;
        best_end = w + 1;
      }
    }
    const double begin = run->t.front();
    Finding finding;
    finding.fault = "still";
    finding.severity = Severity::kHarmful;
    finding.file = run->name;
    finding.t_start = begin + (best_end - best) * kWindow;
    finding.t_end = begin + best_end * kWindow;
    finding.weight = 100.0 * still / windows;
    finding.evidence = "nothing moves in " +
                       ShortNumber(100.0 * still / windows) + " % of " +
                       ShortNumber(duration) + " s, longest for " +
                       ShortNumber(best * kWindow) + " s";
    finding.consequence =
        "what stands still tells of dry friction alone, and weighs in the "
        "error as if it were predicted";
    for (const Series& series : of_run) {
      CheckInput edited = input;
      finding.remedies.push_back(
          IgnoreFlag(edited, run->name, series.column,
                     {{finding.t_start, finding.t_end}}));
    }
    findings->push_back(finding);
  }
}

void CheckQuantisation(const CheckInput& input,
                       std::vector<Finding>* findings) {
  constexpr double kCoarse = 150;  // levels over the range
  for (const Series& series : AllSeries(input)) {
    if (series.channel->kind == ChannelKind::kVelocity) continue;
    std::vector<double> levels = series.y;
    std::sort(levels.begin(), levels.end());
    levels.erase(std::unique(levels.begin(), levels.end(),
                             [&](double a, double b) {
                               return b - a < 1e-7 * series.range;
                             }),
                 levels.end());
    if (levels.size() < 3 || series.y.size() < 3 * levels.size()) continue;
    std::vector<double> gaps;
    for (size_t i = 1; i < levels.size(); ++i) {
      gaps.push_back(levels[i] - levels[i - 1]);
    }
    const double quantum = Median(gaps);
    if (series.range / quantum > kCoarse) continue;
    const bool regular = std::all_of(gaps.begin(), gaps.end(), [&](double gap) {
      const double steps = gap / quantum;
      return std::abs(steps - std::round(steps)) < 0.1;
    });
    if (!regular) continue;
    Finding finding = At(series, "quantisation", Severity::kHarmful);
    finding.weight = 1e3 * quantum / series.range;
    finding.evidence = "it has " + std::to_string(levels.size()) + " levels, " +
                       ShortNumber(quantum) +
                       " apart: " + ShortNumber(100 * quantum / series.range) +
                       " % of its range";
    finding.consequence =
        "the error is that of rounding, the same for many samples: intervals "
        "come out too narrow, velocities rough";
    finding.remedies = {"--noise " + ShortNumber(quantum / std::sqrt(12.0))};
    findings->push_back(finding);
  }
}

}  // namespace sysid
