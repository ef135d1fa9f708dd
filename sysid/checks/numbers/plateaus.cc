// Values that stand still while the mechanism does not: a sensor at its end, a
// channel that hangs or drops out.

#include <algorithm>
#include <cmath>
#include <optional>

#include "sysid/checks/remedy.h"
#include "sysid/checks/series.h"
#include "sysid/checks/shipped_checks.h"
#include "sysid/io/cell.h"

namespace sysid {
namespace {

struct Plateau {
  int first, last;     // samples of one and the same value
  double entry, exit;  // mean step over the samples before, behind
  double jump_in, jump_out;
  bool cuts_motion;  // it comes and goes at a speed that does not end there
};

// Dry friction stops a motion within the last step but one: what takes longer
// than two steps to stop, or to get going, was under way.
bool IsUnderWay(double at, double nearby, double noise) {
  return std::abs(at) > 2.0 * std::abs(at - nearby) + 12.0 * noise;
}

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
      Plateau p{first, last, 0, 0, 0, 0, false};
      if (first - before >= 2) {
        p.entry = std::abs(y[first - 1] - y[before]) / (first - 1 - before);
        p.jump_in = std::abs(y[first] - y[first - 1]);
      }
      if (behind - last >= 2) {
        p.exit = std::abs(y[behind] - y[last + 1]) / (behind - last - 1);
        p.jump_out = std::abs(y[last + 1] - y[last]);
      }
      // The last value held is one of the motion; the first behind comes from
      // wherever the motion has gone meanwhile.
      p.cuts_motion = first >= 2 && last + 3 < n &&
                      IsUnderWay(y[first] - y[first - 1],
                                 y[first - 1] - y[first - 2], series.noise) &&
                      IsUnderWay(y[last + 2] - y[last + 1],
                                 y[last + 3] - y[last + 2], series.noise);
      plateaus.push_back(p);
    }
    first = last + 1;
  }
  return plateaus;
}

// Whether a value follows itself only within plateaus. In a channel of coarse
// digits that rests, or nearly so, values repeat all the time.
bool RepeatsAreRare(const Series& series,
                    const std::vector<Plateau>& plateaus) {
  constexpr double kRare = 0.002;  // of the samples
  const size_t n = series.y.size();
  int repeats = 0;
  for (size_t k = 1; k < n; ++k) repeats += series.y[k] == series.y[k - 1];
  for (const Plateau& p : plateaus) repeats -= p.last - p.first;
  return repeats <= kRare * n;
}

bool IsExtreme(const Series& series, double value) {
  const auto [low, high] =
      std::minmax_element(series.y.begin(), series.y.end());
  return value == *low || value == *high;
}

// The step of a column's digits, of a coarse one; else a small one of its
// motion.
double FindQuantum(const Series& series) {
  std::vector<double> steps;
  for (size_t k = 1; k < series.y.size(); ++k) {
    const double step = std::abs(series.y[k] - series.y[k - 1]);
    if (step > 0.0) steps.push_back(step);
  }
  return Percentile(std::move(steps), 0.05);
}

// Of a plateau at the largest or smallest value: a swing that turns comes to
// its end slowly, v = 0 there. It is cut off where it runs into the end at a
// good part of its speed. In coarse digits a swing stays for 2 h samples within
// the last step q >= a h^2 / 2, and goes 3 a h^2 / 2 <= 3 q in the h before.
bool RunsIntoEnd(const Series& series, const Plateau& p, double quantum) {
  const std::vector<double>& y = series.y;
  const int h = std::max(4, (p.last - p.first + 1) / 2);
  const int n = static_cast<int>(y.size());
  const double came = std::abs(y[p.first] - y[std::max(0, p.first - h)]);
  const double went = std::abs(y[std::min(n - 1, p.last + h)] - y[p.last]);
  return std::max(p.entry, p.exit) > 0.3 * series.step &&
         p.jump_in <= 3 * series.step && p.jump_out <= 3 * series.step &&
         std::max(came, went) > 6 * quantum;
}

Finding OfSpans(const CheckInput& input, const Series& series,
                const std::vector<std::pair<int, int>>& spans,
                const std::string& fault, const std::string& what,
                const std::string& consequence) {
  int samples = 0;
  for (const auto& [first, last] : spans) samples += last - first + 1;
  Finding finding = At(series, fault, Severity::kWrong);
  finding.weight = 1e3 * samples / series.y.size();
  finding.t_start = series.t[spans.front().first];
  finding.t_end = series.t[spans.back().second];
  finding.evidence = what + ", " + CountOf(spans.size(), "time") + ", " +
                     std::to_string(samples) + " of " +
                     std::to_string(series.y.size()) + " samples";
  finding.consequence = consequence;
  finding.remedies = {IgnoreFlag(input, series.run->name, {series.column},
                                 Times(series.t, spans))};
  return finding;
}

// The digits of a column that has few: even levels, many samples on each.
struct Digits {
  int levels = 0;
  double quantum = 0.0;
};
std::optional<Digits> CoarseDigits(const Series& series) {
  constexpr double kCoarse = 150;  // levels over the range
  std::vector<double> levels = series.y;
  std::sort(levels.begin(), levels.end());
  levels.erase(std::unique(levels.begin(), levels.end(),
                           [&](double a, double b) {
                             return b - a < 1e-7 * series.range;
                           }),
               levels.end());
  if (levels.size() < 3 || series.y.size() < 3 * levels.size()) return {};
  std::vector<double> gaps;
  for (size_t i = 1; i < levels.size(); ++i) {
    gaps.push_back(levels[i] - levels[i - 1]);
  }
  const double quantum = Median(gaps);
  const bool regular = std::all_of(gaps.begin(), gaps.end(), [&](double gap) {
    const double steps = gap / quantum;
    return std::abs(steps - std::round(steps)) < 0.1;
  });
  if (!regular || series.range / quantum > kCoarse) return {};
  return Digits{static_cast<int>(levels.size()), quantum};
}

}  // namespace

void CheckSaturation(const CheckInput& input, std::vector<Finding>* findings) {
  constexpr int kLeast = 8;  // samples: a rounded swing turns within fewer
  for (const Series& series : AllSeries(input)) {
    const double quantum = FindQuantum(series);
    std::vector<std::pair<int, int>> spans;
    std::vector<double> levels;  // of either end
    for (const Plateau& p : FindPlateaus(series, kLeast)) {
      const double value = series.y[p.first];
      if (!IsExtreme(series, value)) continue;
      spans.push_back({p.first, p.last});
      if (RunsIntoEnd(series, p, quantum) &&
          std::find(levels.begin(), levels.end(), value) == levels.end()) {
        levels.push_back(value);
      }
    }
    if (levels.empty()) continue;
    std::erase_if(spans, [&](const auto& s) {
      return std::find(levels.begin(), levels.end(), series.y[s.first]) ==
             levels.end();
    });
    Finding finding = OfSpans(
        input, series, spans, "saturation",
        "it runs into " + ShortNumber(levels.front()) +
            (levels.size() > 1 ? " and " + ShortNumber(levels.back()) : "") +
            " and stays there exactly",
        "the motion went on beyond the range of the sensor: the fitted motion "
        "is too slow and too small");
    // What sticks within the last step of coarse digits looks the same: these
    // are certain, and stand first.
    if (CoarseDigits(series)) {
      finding.severity = Severity::kHarmful;
      finding.weight = 0.0;
      finding.consequence +=
          "; or the joint sticks within one quantisation step";
    }
    findings->push_back(finding);
  }
}

namespace {

// A position that never changes, to the last digit, where others do.
void FindDead(const CheckInput& input, const std::vector<Series>& all,
              std::vector<Finding>* findings) {
  constexpr size_t kLeast = 20;  // samples
  for (const Series& series : all) {
    const bool others_move =
        std::any_of(all.begin(), all.end(), [&](const Series& other) {
          return other.run == series.run && other.range > 0.0;
        });
    if (series.range > 0.0 || series.y.size() < kLeast || !others_move ||
        !IsScalarPosition(series.channel->kind)) {
      continue;
    }
    Finding finding = At(series, "frozen", Severity::kHarmful);
    finding.weight = 1e3;
    finding.evidence = "it is " + ShortNumber(series.y.front()) +
                       " in all samples, to the last digit, while others move";
    finding.consequence =
        "a sensor that does not work, or a joint that was held still: the "
        "model lets it move";
    finding.remedies = {
        IgnoreFlag(
            input, series.run->name, {series.column},
            Times(series.t, {{0, static_cast<int>(series.t.size()) - 1}})),
        "--lock " +
            input.model->mechanism().joints[series.channel->target].name + "=" +
            ShortestText(series.y.front()) + "  (if it was held still)"};
    findings->push_back(finding);
  }
}

}  // namespace

void CheckFrozen(const CheckInput& input, std::vector<Finding>* findings) {
  constexpr int kLeast = 4;  // samples
  const std::vector<Series> all = AllSeries(input);
  FindDead(input, all, findings);
  for (const Series& series : all) {
    const std::vector<Plateau> plateaus = FindPlateaus(series, kLeast);
    const bool rare = RepeatsAreRare(series, plateaus);
    std::vector<std::pair<int, int>> spans;
    for (const Plateau& p : plateaus) {
      // What sticks comes to rest and leaves slowly, however fast the motion is
      // elsewhere: where values never repeat otherwise, the steps nearby are
      // what a jump is measured by.
      const double nearby = rare ? std::max(p.entry, p.exit) : series.step;
      const double jump = std::max(3.0 * nearby, 12.0 * series.noise);
      const bool is_end = IsExtreme(series, series.y[p.first]);
      if (p.jump_out > jump || p.jump_in > jump ||
          (rare && p.cuts_motion && !(is_end && RunsIntoEnd(series, p, 0.0)))) {
        spans.push_back({p.first + (p.jump_in > jump ? 0 : 1), p.last});
      }
    }
    if (spans.empty() || spans.size() > 50) continue;
    findings->push_back(
        OfSpans(input, series, spans, "frozen",
                "it stands at " + ShortNumber(series.y[spans.front().first]) +
                    " exactly, and the motion comes and goes at speed",
                "the channel hung or dropped out while the motion went on"));
  }
}

void CheckQuantisation(const CheckInput& input,
                       std::vector<Finding>* findings) {
  for (const Series& series : AllSeries(input)) {
    if (series.channel->kind == ChannelKind::kVelocity) continue;
    const std::optional<Digits> digits = CoarseDigits(series);
    if (!digits) continue;
    const double quantum = digits->quantum;
    Finding finding = At(series, "quantisation", Severity::kHarmful);
    finding.weight = 1e3 * quantum / series.range;
    finding.evidence = "it has " + std::to_string(digits->levels) +
                       " levels, " + ShortNumber(quantum) +
                       " apart: " + ShortNumber(100 * quantum / series.range) +
                       " % of its range";
    finding.consequence =
        "rounding errors are correlated over many samples: confidence "
        "intervals are too narrow, velocities rough";
    finding.remedies = {"--noise " + ShortNumber(quantum / std::sqrt(12.0))};
    findings->push_back(finding);
  }
}

}  // namespace sysid
