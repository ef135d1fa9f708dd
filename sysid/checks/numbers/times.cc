// Time stamps: jitter that is the stamps' and not the sampling's, lost samples,
// too few of them.

#include <algorithm>
#include <cmath>

#include "sysid/checks/excerpt.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/series.h"
#include "sysid/checks/shipped_checks.h"
#include "sysid/estimation/noise.h"
#include "sysid/io/cell.h"

namespace sysid {
namespace {

// Rms of what no smooth curve through a column explains, by the stamps of its
// samples and by their count.
struct Roughness {
  double by_stamps = 0.0, by_count = 0.0;
};

// Over the third of the column that moves the most: a stamp that is wrong shows
// where there is speed, and elsewhere only the noise does.
Roughness RoughnessInMotion(const Series& series, double period) {
  constexpr int kBlock = 50;  // samples
  const int n = static_cast<int>(series.y.size());
  const int blocks = std::max(1, n / kBlock);
  struct Block {
    int first, last;
    double path;
  };
  std::vector<Block> all;
  for (int b = 0; b < blocks; ++b) {
    Block block{b * n / blocks, (b + 1) * n / blocks, 0.0};
    for (int k = block.first + 1; k < block.last; ++k) {
      block.path += std::abs(series.y[k] - series.y[k - 1]);
    }
    all.push_back(block);
  }
  std::sort(all.begin(), all.end(),
            [](const Block& a, const Block& b) { return a.path > b.path; });
  all.resize((blocks + 2) / 3);
  Roughness rough;
  for (const Block& block : all) {
    const auto part = [&](const std::vector<double>& of) {
      return std::vector<double>(of.begin() + block.first,
                                 of.begin() + block.last);
    };
    std::vector<double> even(block.last - block.first);
    for (size_t k = 0; k < even.size(); ++k) even[k] = k * period;
    const std::vector<double> y = part(series.y);
    rough.by_stamps += std::pow(EstimateNoise(part(series.t), y), 2);
    rough.by_count += std::pow(EstimateNoise(even, y), 2);
  }
  rough.by_stamps = std::sqrt(rough.by_stamps / all.size());
  rough.by_count = std::sqrt(rough.by_count / all.size());
  return rough;
}

}  // namespace

// Where the samples were even and their stamps are not, the motion is smoother
// by the count of the samples than by their stamps.
void CheckJitter(const CheckInput& input, std::vector<Finding>* findings) {
  constexpr double kRougher = 2.0, kSmoother = 0.7;
  const std::vector<Series> all = MotionSeries(input);
  for (const Run* run : input.runs) {
    const double period = MedianPeriod(run->t);
    std::vector<double> off;
    for (int k = 1; k < run->size(); ++k) {
      off.push_back(std::abs(run->t[k] - run->t[k - 1] - period));
    }
    const double spread = Percentile(off, 0.68);
    if (spread < 0.01 * period) continue;
    // A column at rest is as smooth by either; none may be smoother by the
    // stamps.
    double most = 0.0, least = INFINITY, by_stamps = 0.0;
    std::string column;
    for (const Series& series : all) {
      if (series.run != run || series.t.size() != run->t.size()) continue;
      const Roughness rough = RoughnessInMotion(series, period);
      if (!(rough.by_count > 0.0)) continue;
      const double ratio = rough.by_stamps / rough.by_count;
      least = std::min(least, ratio);
      if (ratio <= most) continue;
      most = ratio;
      by_stamps = rough.by_stamps;
      column = series.column;
    }
    if (most < kRougher || least < kSmoother) continue;
    Finding finding = At(*run, "t", kTimeJitter, Severity::kHarmful);
    finding.weight = most;
    finding.evidence = "the steps of t vary by " + ShortNumber(1e3 * spread) +
                       " ms about " + ShortNumber(1e3 * period) + " ms, but " +
                       column + " is " + ShortNumber(most) +
                       " times smoother over evenly spaced times: "
                       "sampling was even, and the time stamps are wrong";
    finding.consequence =
        "an error of a time stamp causes a position error of velocity times "
        "that error, " +
        ShortNumber(by_stamps) + " in " + column;
    finding.remedies = {
        "record t where the sample is taken, or write even "
        "times: sample number times " +
            ShortNumber((run->t.back() - run->t.front()) / (run->size() - 1)),
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
    Finding finding = At(*run, "t", "gap", Severity::kHarmful);
    finding.weight = longest / period;
    finding.t_start = at;
    finding.t_end = at + longest;
    finding.evidence = "about " + ShortNumber(lost) + " samples of " +
                       ShortNumber(1e3 * period) + " ms are lost in " +
                       CountOf(gaps, "gap") + ", the longest of " +
                       ShortNumber(longest) + " s";
    finding.consequence = "the efforts there are unknown: the last one is held";
    finding.remedies = {"cut the file at " + ShortNumber(at) +
                        " s into two, and give both to --traj"};
    findings->push_back(finding);
  }
}

void CheckSamples(const CheckInput& input, std::vector<Finding>* findings) {
  constexpr double kEnough = 3.0;  // numbers for each that is fitted
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
    Finding finding = At(*run, "t", "few_samples", Severity::kHarmful);
    finding.evidence = ShortNumber(numbers) + " numbers in " +
                       std::to_string(run->size()) + " samples, for " +
                       ShortNumber(fitted) + " that are to be fitted";
    finding.consequence =
        "too few to estimate the noise or to judge the error of a fit";
    finding.remedies = {"record longer, or at a higher rate"};
    findings->push_back(finding);
  }
}

}  // namespace sysid
