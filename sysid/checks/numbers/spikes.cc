// Single values that no motion explains: they jump away and come back.

#include <algorithm>
#include <cmath>

#include "sysid/checks/remedy.h"
#include "sysid/checks/series.h"
#include "sysid/checks/shipped_checks.h"
#include "sysid/io/cell.h"
#include "sysid/io/run_columns.h"

namespace sysid {
namespace {

// Samples whose distance from the median of the seven around exceeds three
// steps of the motion and twelve times the noise. (The median lies within three
// samples of a smooth motion; a spike of up to three samples does not move it.)
std::vector<std::pair<int, int>> FindSpikes(const Series& series) {
  const int n = static_cast<int>(series.y.size());
  std::vector<std::pair<int, int>> spikes;
  const double least = std::max(3.0 * series.step, 12.0 * series.noise);
  // Not at the ends, where the seven are all on one side.
  for (int k = 3; k + 3 < n; ++k) {
    const int from = k - 3;
    const auto begin = series.y.begin() + from;
    const double middle = Median(std::vector<double>(begin, begin + 7));
    if (std::abs(series.y[k] - middle) <= least) continue;
    if (!spikes.empty() && spikes.back().second == k - 1) {
      spikes.back().second = k;
    } else {
      spikes.push_back({k, k});
    }
  }
  return spikes;
}

const Joint& OfGroup(const CheckInput& input, const ColumnGroup& group) {
  return input.model->mechanism().joints[group.target];
}

// Samples that are farther from both neighbours, on the same side, than nearly
// all values are apart.
std::vector<int> FindSinglePeaks(const Eigen::VectorXd& y) {
  const std::vector<double> values(y.begin(), y.end());
  const double span = Percentile(values, 0.98) - Percentile(values, 0.02);
  std::vector<int> peaks;
  if (!(span > 0.0)) return peaks;
  for (int k = 1; k + 1 < y.size(); ++k) {
    const double in = y[k] - y[k - 1], out = y[k] - y[k + 1];
    if (in * out > 0.0 && std::min(std::abs(in), std::abs(out)) > span) {
      peaks.push_back(k);
    }
  }
  return peaks;
}

}  // namespace

void CheckSpikes(const CheckInput& input, std::vector<Finding>* findings) {
  for (const Series& series : AllSeries(input)) {
    if (series.channel->kind == ChannelKind::kVelocity) continue;
    const std::vector<std::pair<int, int>> spikes = FindSpikes(series);
    const size_t most = std::max<size_t>(3, series.y.size() / 20);
    if (spikes.empty() || spikes.size() > most) continue;
    double largest = 0.0;
    int at = 0;
    for (const auto& [first, last] : spikes) {
      for (int k = first; k <= last; ++k) {
        const double jump =
            std::abs(series.y[k] - series.y[std::max(0, k - 1)]);
        if (jump > largest) {
          largest = jump;
          at = k;
        }
      }
    }
    Finding finding = At(series, "spikes", Severity::kWrong);
    finding.weight = largest / std::max(series.step, 1e-12);
    finding.t_start = series.t[spikes.front().first];
    finding.t_end = series.t[spikes.back().second];
    finding.evidence =
        std::to_string(spikes.size()) +
        (spikes.size() == 1 ? " value jumps" : " values jump") +
        " away and back, by up to " + ShortNumber(largest) + " at " +
        ShortNumber(series.t[at]) + " s; the motion makes at most " +
        ShortNumber(series.step) + " from one sample to the next";
    finding.consequence =
        "outliers bias a least-squares fit of the whole trajectory";
    const auto spans = Times(series.t, spikes);
    constexpr size_t kMost = 20;
    if (spans.size() <= kMost) {
      finding.remedies.push_back(
          IgnoreFlag(input, series.run->name, {series.column}, spans));
    }
    finding.remedies.push_back("--loss huber");
    findings->push_back(finding);
  }
}

// A command may step, and stay; what leaves for a single sample, farther than
// all commands span, and returns is a spike. The samples are held: it pushes.
void CheckEffortSpikes(const CheckInput& input,
                       std::vector<Finding>* findings) {
  for (const Run* run : input.runs) {
    for (const ColumnGroup& group : RunColumnGroups(input.model->mechanism())) {
      const Joint* joint = group.is_effort ? &OfGroup(input, group) : nullptr;
      if (joint == nullptr || VelocitySize(*joint) != 1) continue;
      const Eigen::VectorXd effort = run->effort.col(joint->v_index);
      const std::vector<int> spikes = FindSinglePeaks(effort);
      const size_t most = std::max<size_t>(3, run->t.size() / 50);
      if (spikes.empty() || spikes.size() > most) continue;
      Finding finding =
          At(*run, group.columns.front(), "spikes", Severity::kWrong);
      finding.weight = static_cast<double>(spikes.size());
      finding.t_start = run->t[spikes.front()];
      finding.t_end = run->t[spikes.back()];
      finding.evidence = CountOf(spikes.size(), "value") +
                         (spikes.size() == 1 ? " jumps" : " jump") +
                         " away for one sample and back, the first to " +
                         ShortNumber(effort[spikes.front()]) + " at " +
                         ShortNumber(run->t[spikes.front()]) + " s";
      finding.consequence =
          "the spike acts on the model, but did not act on the mechanism";
      finding.remedies = {
          "write the effort of the sample before in their place"};
      findings->push_back(finding);
    }
  }
}

}  // namespace sysid
