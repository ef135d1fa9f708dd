#include "tests/acceptance/checks/resampled.h"

#include <algorithm>
#include <cmath>

#include "sysid/checks/excerpt.h"

namespace sysid {

Run WithoutRows(const Run& run, int first, int last) {
  Run cut = run;
  const int n = run.size(), lost = last - first;
  cut.t.erase(cut.t.begin() + first, cut.t.begin() + last);
  const auto drop = [&](RowMatrixXd* rows) {
    RowMatrixXd kept(n - lost, rows->cols());
    kept << rows->topRows(first), rows->bottomRows(n - last);
    *rows = kept;
  };
  drop(&cut.effort);
  for (Channel& channel : cut.channels) drop(&channel.values);
  return cut;
}

Run Thinned(const Run& run, int stride) {
  Run thin = run;
  const int n = run.size() / stride;
  thin.t.clear();
  thin.effort.resize(n, run.effort.cols());
  for (size_t c = 0; c < run.channels.size(); ++c) {
    thin.channels[c].values.resize(n, run.channels[c].values.cols());
  }
  for (int k = 0; k < n; ++k) {
    thin.t.push_back(run.t[k * stride]);
    thin.effort.row(k) = run.effort.row(k * stride);
    for (size_t c = 0; c < run.channels.size(); ++c) {
      thin.channels[c].values.row(k) = run.channels[c].values.row(k * stride);
    }
  }
  return thin;
}

Run AfterRest(const std::vector<Series>& motion, const Run& run,
              std::mt19937_64* engine) {
  Run rested = run;
  const int n = run.size(), more = 2 * n;
  const double period = MedianPeriod(run.t);
  rested.t.clear();
  for (int k = 0; k < more; ++k) {
    rested.t.push_back(run.t[0] - period * (more - k));
  }
  rested.t.insert(rested.t.end(), run.t.begin(), run.t.end());
  rested.effort = RowMatrixXd::Zero(more + n, run.effort.cols());
  rested.effort.bottomRows(n) = run.effort;
  for (size_t c = 0; c < run.channels.size(); ++c) {
    double sigma = 0.0;
    for (const Series& series : motion) {
      if (series.channel == &run.channels[c]) sigma = series.noise;
    }
    std::normal_distribution<double> noise(0.0, sigma);
    RowMatrixXd values(more + n, run.channels[c].values.cols());
    values.topRows(more).rowwise() = run.channels[c].values.row(0);
    for (double& v : values.topRows(more).reshaped()) v += noise(*engine);
    values.bottomRows(n) = run.channels[c].values;
    if (run.channels[c].kind == ChannelKind::kOrientation) {
      values.rowwise().normalize();
    }
    rested.channels[c].values = values;
  }
  return rested;
}

double Swings(const Mechanism& mechanism, const std::vector<Series>& motion,
              const Run& run) {
  double most = 1.0;
  for (const Series& series : motion) {
    if (series.run != &run) continue;
    int count = 0, direction = 0;
    const double least = 0.05 * series.range;
    double last = series.y.front();
    for (const double y : series.y) {
      const double step = y - last;
      if (std::abs(step) < least) continue;
      count += direction * step < 0;
      direction = step > 0 ? 1 : -1;
      last = y;
    }
    most = std::max(most, 1.0 * count);
    if (series.channel->kind == ChannelKind::kPosition &&
        IsRotation1(mechanism.joints[series.channel->target].type)) {
      const double way = std::abs(series.y.back() - series.y.front());
      most = std::max(most, way / M_PI);
    }
  }
  return most;
}

int FastestStretch(const Run& run, int samples) {
  int best = 0;
  double farthest = -1.0;
  for (const Channel& channel : run.channels) {
    const auto [low, high] = std::minmax_element(
        channel.values.data(), channel.values.data() + channel.values.size());
    const double range = *high - *low;
    for (int k = 0; k + samples <= run.size(); ++k) {
      const double way =
          std::abs(channel.values(k + samples - 1, 0) - channel.values(k, 0));
      if (way <= farthest * range) continue;
      farthest = way / range;
      best = k;
    }
  }
  return best;
}

}  // namespace sysid
