#include "sysid/checks/series.h"

#include <algorithm>
#include <cmath>

#include "sysid/estimation/noise.h"
#include "sysid/io/run_columns.h"

namespace sysid {

double Percentile(std::vector<double> values, double part) {
  if (values.empty()) return 0.0;
  const size_t at =
      std::min(values.size() - 1, static_cast<size_t>(part * values.size()));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[at];
}

double Median(std::vector<double> values) {
  return Percentile(std::move(values), 0.5);
}

std::vector<Series> AllSeries(const CheckInput& input) {
  const Mechanism& mechanism = input.model->mechanism();
  const std::vector<ColumnGroup> groups = RunColumnGroups(mechanism);
  std::vector<Series> all;
  for (const Run* run : input.runs) {
    for (const Channel& channel : run->channels) {
      if (channel.kind == ChannelKind::kOrientation) continue;
      const auto group =
          std::find_if(groups.begin(), groups.end(), [&](const ColumnGroup& g) {
            return !g.is_effort && g.kind == channel.kind &&
                   g.target == channel.target;
          });
      const bool wraps = channel.kind == ChannelKind::kPosition &&
                         IsRotation1(mechanism.joints[channel.target].type);
      for (size_t c = 0; c < group->columns.size(); ++c) {
        Series series;
        series.run = run;
        series.channel = &channel;
        series.column = group->columns[c];
        for (int k = 0; k < run->size(); ++k) {
          double value = channel.values(k, group->slots[c]);
          if (std::isnan(value)) continue;
          if (wraps && !series.y.empty()) {
            const double turns = (value - series.y.back()) / (2 * M_PI);
            // Only whole turns are the sensor's: half of one is a jump.
            if (std::abs(turns - std::round(turns)) < 0.2) {
              value -= 2 * M_PI * std::round(turns);
            }
          }
          series.t.push_back(run->t[k]);
          series.y.push_back(value);
        }
        if (series.y.size() < 5) continue;
        const auto [low, high] =
            std::minmax_element(series.y.begin(), series.y.end());
        series.range = *high - *low;
        series.noise = EstimateNoise(series.t, series.y);
        std::vector<double> steps;
        for (size_t k = 1; k < series.y.size(); ++k) {
          steps.push_back(std::abs(series.y[k] - series.y[k - 1]));
        }
        series.step = Percentile(std::move(steps), 0.95);
        all.push_back(std::move(series));
      }
    }
  }
  return all;
}

Finding At(const Series& series, const std::string& fault, Severity severity) {
  Finding finding;
  finding.fault = fault;
  finding.severity = severity;
  finding.file = series.run->name;
  finding.subject = series.column;
  return finding;
}

std::vector<std::pair<double, double>> Times(
    const std::vector<double>& t,
    const std::vector<std::pair<int, int>>& samples) {
  std::vector<std::pair<double, double>> times;
  const int n = static_cast<int>(t.size());
  const auto rounded = [](double value, bool up) {
    const double ticks = value * 1e5;
    return (up ? std::ceil(ticks) : std::floor(ticks)) / 1e5;
  };
  for (const auto& [first, last] : samples) {
    const double from = first > 0 ? 0.5 * (t[first] + t[first - 1]) : t[first];
    const double to = last + 1 < n ? 0.5 * (t[last] + t[last + 1]) : t[last];
    if (!times.empty() && from <= times.back().second + 1e-4) {
      times.back().second = rounded(to, true);
    } else {
      times.push_back({rounded(from, false), rounded(to, true)});
    }
  }
  return times;
}

}  // namespace sysid
