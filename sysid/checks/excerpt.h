#pragma once

#include <functional>
#include <vector>

#include "models/mechanism.h"
#include "residuals/run.h"

namespace sysid {

// A part of the recordings that a coarse fit can afford: windows of one length
// in which there is motion, spread over all runs, at no more than about 250
// samples a second. Each window keeps some samples on either side, so that what
// shifts a channel in time has something to take.
class Excerpt {
 public:
  // At most about `most_samples` samples in all.
  Excerpt(const std::vector<const Run*>& runs, int most_samples);

  bool empty() const { return windows_.empty(); }
  double window_s() const { return window_s_; }
  double period_s() const { return period_s_; }  // of the samples that are kept

  int count() const { return static_cast<int>(windows_.size()); }
  int run(int window) const { return windows_[window].run; }

  // What is done to a window, wide as it is, of the run with this index.
  using Change = std::function<void(int run, Run* window)>;

  // The windows after `change` (may be empty); a run a window. With what they
  // keep on either side, up to kMargin, and all samples, where they are `wide`.
  std::vector<Run> Windows(const Change& change, bool wide = false) const;
  static constexpr double kMargin = 0.15;  // s

 private:
  struct Window {
    int run = 0;
    Run wide;
    int first = 0, last = 0;  // samples of the window itself, [first, last)
  };
  std::vector<Window> windows_;
  double window_s_ = 0.0, period_s_ = 0.0;
  int stride_ = 1;  // of the samples, those that are kept
};

// Median time between samples, s.
double MedianPeriod(const std::vector<double>& t);

}  // namespace sysid
