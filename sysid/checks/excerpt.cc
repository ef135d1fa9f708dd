#include "sysid/checks/excerpt.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sysid/checks/series.h"
#include "sysid/io/run_rows.h"

namespace sysid {
namespace {

constexpr double kFastest = 250.0;  // Hz

// The mean of the squared changes from one tenth of the window to the next,
// each channel by its own scale: what moves tells more.
double MotionIn(const Run& run, int first, int last,
                const std::vector<double>& scale) {
  double motion = 0.0;
  const int stride = std::max(1, (last - first) / 10);
  for (size_t c = 0; c < run.channels.size(); ++c) {
    if (scale[c] <= 0.0) continue;
    for (int k = first + stride; k < last; k += stride) {
      const double change = (run.channels[c].values.row(k) -
                             run.channels[c].values.row(k - stride))
                                .norm();
      if (!std::isnan(change)) motion += std::min(1.0, change / scale[c]);
    }
  }
  return motion;
}

// The range of each channel.
std::vector<double> ScaleOf(const Run& run) {
  std::vector<double> scale;
  for (const Channel& channel : run.channels) {
    const auto column = channel.values.col(0);
    const double low = column.minCoeff<Eigen::PropagateNumbers>();
    const double high = column.maxCoeff<Eigen::PropagateNumbers>();
    scale.push_back(high > low ? high - low : 0.0);
  }
  return scale;
}

// Keeps every stride-th sample; efforts are the means of what they stand for.
Run Thin(const Run& run, int stride) {
  if (stride == 1) return run;
  Run thin;
  thin.name = run.name;
  const int n = run.size() / stride;
  thin.recorded_efforts = run.recorded_efforts;
  thin.effort = RowMatrixXd::Zero(n, run.effort.cols());
  for (int k = 0; k < n; ++k) {
    thin.t.push_back(run.t[k * stride]);
    thin.effort.row(k) =
        run.effort.middleRows(k * stride, stride).colwise().mean();
  }
  for (const Input& input : run.inputs) {
    thin.inputs.push_back({input.name, input.held, {}});
    for (int k = 0; k < n; ++k) {
      const auto first = input.values.begin() + k * stride;
      thin.inputs.back().values.push_back(
          input.held ? std::accumulate(first, first + stride, 0.0) / stride
                     : *first);
    }
  }
  for (const Channel& channel : run.channels) {
    Channel kept = channel;
    kept.values.resize(n, channel.values.cols());
    for (int k = 0; k < n; ++k) {
      kept.values.row(k) = channel.values.row(k * stride);
    }
    thin.channels.push_back(kept);
  }
  return thin;
}

}  // namespace

double MedianPeriod(const std::vector<double>& t) {
  std::vector<double> periods;
  for (size_t k = 1; k < t.size(); ++k) periods.push_back(t[k] - t[k - 1]);
  return Median(std::move(periods));
}

Excerpt::Excerpt(const std::vector<const Run*>& runs, int most_samples) {
  constexpr int kWindowSamples = 60;
  constexpr double kShortest = 0.5, kLongest = 3.2;  // s
  if (runs.empty()) return;
  const double period = MedianPeriod(runs.front()->t);
  stride_ = std::max(1, static_cast<int>(std::lround(1.0 / kFastest / period)));
  period_s_ = stride_ * period;
  window_s_ = std::clamp(kWindowSamples * period_s_, kShortest, kLongest);
  // Of short recordings shorter ones, so that there are ten: five to fit and
  // five to judge by, of which a standard error can be had.
  constexpr double kWindows = 10.0, kBriefest = 0.25;  // s
  double total = 0.0;
  for (const Run* run : runs) total += run->t.back() - run->t.front();
  window_s_ = std::min(window_s_, std::max(kBriefest, total / kWindows));
  struct Place {
    int run;
    int first, last;
    double motion;
  };
  std::vector<Place> places;
  for (int r = 0; r < static_cast<int>(runs.size()); ++r) {
    const Run* run = runs[r];
    const std::vector<double> scale = ScaleOf(*run);
    // Not at the very ends: what is shifted there has nothing to take.
    constexpr double kEdge = 0.06;  // s
    const double begin = run->t.front() + kEdge, finish = run->t.back() - kEdge;
    int start = 0;
    while (start + 1 < run->size() && run->t[start] < begin) ++start;
    for (int first = start; first < run->size();) {
      const double end = std::min(finish, run->t[first] + window_s_);
      int last = first + 1;
      while (last < run->size() && run->t[last] < end) ++last;
      // Where samples are lost the efforts are unknown.
      constexpr double kGap = 4.5;
      bool gap = false;
      for (int k = first + 1; k < last; ++k) {
        gap = gap || run->t[k] - run->t[k - 1] > kGap * period;
      }
      const bool whole = run->t[last - 1] - run->t[first] > 0.6 * window_s_;
      if (whole && !gap && last - first >= 8 * stride_) {
        places.push_back({r, first, last, MotionIn(*run, first, last, scale)});
      }
      first = last;
    }
  }
  // Of those with motion (at least a fifth of the median), evenly many.
  std::vector<double> motions;
  for (const Place& place : places) motions.push_back(place.motion);
  std::sort(motions.begin(), motions.end());
  const double least =
      motions.empty() ? 0.0 : 0.2 * motions[motions.size() / 2];
  std::erase_if(places, [&](const Place& p) { return p.motion < least; });
  const double each = window_s_ / period_s_;
  const int most = std::max(3, static_cast<int>(most_samples / each));
  const int count = std::min<int>(places.size(), most);
  for (int i = 0; i < count; ++i) {
    const Place& place = places[(2 * i + 1) * places.size() / (2 * count)];
    const Run& run = *runs[place.run];
    int from = place.first, to = place.last;
    while (from > 0 && run.t[place.first] - run.t[from - 1] <= kMargin) --from;
    while (to < run.size() && run.t[to] - run.t[place.last - 1] <= kMargin) {
      ++to;
    }
    windows_.push_back({place.run, RowsOf(run, from, to), place.first - from,
                        place.last - from});
  }
}

std::vector<Run> Excerpt::Windows(const Change& change, bool wide) const {
  std::vector<Run> runs;
  for (const Window& window : windows_) {
    Run changed = window.wide;
    if (change) change(window.run, &changed);
    runs.push_back(
        wide ? std::move(changed)
             : Thin(RowsOf(changed, window.first, window.last), stride_));
  }
  return runs;
}

}  // namespace sysid
