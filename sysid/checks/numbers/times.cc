// Time stamps: jitter that is the stamps' and not the sampling's, lost samples,
// too few of them.

#include <algorithm>
#include <cmath>

#include "sysid/checks/excerpt.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/series.h"
#include "sysid/checks/shipped_checks.h"
#include "sysid/estimation/noise.h"

namespace sysid {
namespace {

Finding OfRun(const Run& run, const std::string& fault, Severity severity) {
  Finding finding;
  finding.fault = fault;
  finding.severity = severity;
  finding.file = run.name;
  finding.subject = "t";
  return finding;
}

}  // namespace

// Where the samples were even and their stamps are not, the motion is smoother
// by the count of the samples than by their stamps.
void CheckJitter(const CheckInput& input, std::vector<Finding>* findings) {
  constexpr double kRougher = 2.0;
  for (const Run* run : input.runs) {
    const int n = run->size();
    const double period = MedianPeriod(run->t);
    std::vector<double> off;
    for (int k = 1; k < n; ++k) {
      off.push_back(std::abs(run->t[k] - run->t[k - 1] - period));
    }
    const double spread = Percentile(off, 0.68);
    if (spread < 0.01 * period) continue;
    double ratio = INFINITY, by_stamps = 0.0;
    std::string column;
    for (const Series& series : AllSeries(input)) {
      if (series.run != run || static_cast<int>(series.y.size()) != n) continue;
      std::vector<double> even(n);
      for (int k = 0; k < n; ++k) even[k] = k * period;
      const double smooth = EstimateNoise(even, series.y);
      if (!(smooth > 0.0)) continue;
      if (series.noise / smooth < ratio) {
        ratio = series.noise / smooth;
        by_stamps = series.noise;
        column = series.column;
      }
    }
    if (!std::isfinite(ratio) || ratio < kRougher) continue;
    Finding finding = OfRun(*run, "time_jitter", Severity::kHarmful);
    finding.weight = ratio;
    finding.evidence = "the steps of t vary by " + ShortNumber(1e3 * spread) +
                       " ms about " + ShortNumber(1e3 * period) + " ms, but " +
                       column + " is " + ShortNumber(ratio) +
                       " times smoother by the count of its samples: "
                       "they were even, and the stamps are wrong";
    finding.consequence =
        "each stamp that is wrong is an error of the speed times as much, " +
        ShortNumber(by_stamps) + " in " + column;
    finding.remedies = {
        "record t where the sample is taken, or write even "
        "times: sample number times " +
            ShortNumber((run->t.back() - run->t.front()) / (n - 1)),
        "--noise " + ShortNumber(by_stamps)};
    findings->push_back(finding);
  }
}

void CheckGaps(const CheckInput& input, std::vector<Finding>* findings) {
  constexpr double kSteps = 4.5;
  for (const Run* run : input.runs) {
    const double period = MedianPeriod(run->t);
    double longest = 0.0, at = 0.0, lost = 0.0;
    int gaps = 0;
    for (int k = 1; k < run->size(); ++k) {
      const double step = run->t[k] - run->t[k - 1];
      if (step <= kSteps * period) continue;
      ++gaps;
      lost += step / period - 1;
      if (step > longest) {
        longest = step;
        at = run->t[k - 1];
      }
    }
    if (gaps == 0) continue;
    Finding finding = OfRun(*run, "gap", Severity::kHarmful);
    finding.weight = longest / period;
    finding.t_start = at;
    finding.t_end = at + longest;
    finding.evidence = "about " + ShortNumber(lost) + " samples of " +
                       ShortNumber(1e3 * period) + " ms are lost in " +
                       std::to_string(gaps) + (gaps == 1 ? " gap" : " gaps") +
                       ", the longest of " + ShortNumber(longest) + " s";
    finding.consequence = "the efforts there are unknown: the last one is held";
    finding.remedies = {"cut the file at " + ShortNumber(at) +
                        " s into two, and give both to --traj"};
    findings->push_back(finding);
  }
}

void CheckSamples(const CheckInput& input, std::vector<Finding>* findings) {
  constexpr double kEnough = 3.0;       // numbers for each that is fitted
  constexpr double kTurns = 1.0 / 3.0;  // of the steps: six a period
  for (const Run* run : input.runs) {
    double numbers = 0.0;
    for (const Channel& channel : run->channels) {
      const double each = channel.kind == ChannelKind::kOrientation
                              ? 2.0
                              : channel.values.cols();
      for (int k = 0; k < run->size(); ++k) {
        if (!std::isnan(channel.values(k, 0))) numbers += each;
      }
    }
    const double fitted =
        input.model->tangent_size() + 1.0 * input.free->size();
    if (numbers >= kEnough * fitted) continue;
    Finding finding = OfRun(*run, "few_samples", Severity::kHarmful);
    finding.evidence = ShortNumber(numbers) + " numbers in " +
                       std::to_string(run->size()) + " samples, for " +
                       ShortNumber(fitted) + " that are to be fitted";
    finding.consequence =
        "neither the noise nor the error of a fit can be judged by so few";
    finding.remedies = {"record longer, or at a higher rate"};
    findings->push_back(finding);
  }
  for (const Series& series : AllSeries(input)) {
    if (series.channel->kind == ChannelKind::kVelocity) continue;
    const double least = 0.1 * series.range;
    int steps = 0, turns = 0, direction = 0;
    for (size_t k = 1; k < series.y.size(); ++k) {
      const double step = series.y[k] - series.y[k - 1];
      if (std::abs(step) < least) continue;
      const int now = step > 0 ? 1 : -1;
      ++steps;
      turns += direction != 0 && now != direction;
      direction = now;
    }
    const double part = static_cast<double>(turns) / series.y.size();
    if (steps < 8 || part < kTurns) continue;
    Finding finding = At(series, "slow_sampling", Severity::kHarmful);
    finding.weight = part;
    const double period = MedianPeriod(series.run->t);
    finding.evidence = "it turns at every " + ShortNumber(1.0 / part) +
                       "th sample, " + ShortNumber(period) + " s apart";
    finding.consequence =
        "between so few samples a swing the motion is anybody's guess";
    finding.remedies = {"record at " + ShortNumber(10 * part / period / 2) +
                        " Hz or more"};
    findings->push_back(finding);
  }
}

}  // namespace sysid
