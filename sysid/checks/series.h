#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sysid/checks/check.h"

namespace sysid {

// One number of a channel where it was measured: angles unwrapped. What the
// checks of the numbers look at.
struct Series {
  const Run* run = nullptr;
  const Channel* channel = nullptr;
  std::string column;  // ours: "joint1.q"
  std::vector<double> t, y;
  double range = 0.0;  // largest less smallest
  double noise = 0.0;  // EstimateNoise
  double step = 0.0;   // 95th percentile of |y_{k+1} - y_k|
};

// Of every run and channel of one number, and those of vectors; quaternions
// have none.
std::vector<Series> AllSeries(const CheckInput& input);

// Those and the components of quaternions, their sign made continuous (both
// signs are one rotation): where only it matters whether something moves, and
// how smoothly. `range` and `noise` there are of the component with the most,
// as a component near one hardly changes; `column` is "joint1.q".
std::vector<Series> MotionSeries(const CheckInput& input);

// The channel's first numbers as they were read.
std::vector<double> AsRead(const Series& series);

// Whether a joint's position leaves the limits that the URDF gives it, by more
// than a quarter of their span and but for spikes: they are wrong, or the unit.
bool IsBeyondLimits(const Series& series, const Joint& joint);

double Median(std::vector<double> values);
double Percentile(std::vector<double> values, double part);

// How long a radian of the motion takes, s: the median over runs and channels
// of h median|dq - median dq| / median|ddq|, dq and ddq the first and second
// differences over h. A sinusoid of w has about 1 / w, and what turns on and on
// the time in which its speed changes.
double RadianTime(const std::vector<const Run*>& runs);

// What moves beside the straight line that any state goes on along, without
// forces: sum of squares about it, of vectors y over t.
class SumsOfLine {
 public:
  void Add(double t, const Eigen::RowVectorXd& y);
  double AboutLine() const;

 private:
  int n_ = 0;
  double t_ = 0.0, tt_ = 0.0, first_t_ = 0.0;
  Eigen::RowVectorXd y_, yy_, ty_, first_y_;
};

// A finding in a run ("t", "joint1.tau"), at a series.
Finding At(const Run& run, const std::string& subject, const std::string& fault,
           Severity severity);
Finding At(const Series& series, const std::string& fault, Severity severity);

// Spans of samples [first, last] as times, each widened by half a step, those
// that touch joined.
std::vector<std::pair<double, double>> Times(
    const std::vector<double>& t,
    const std::vector<std::pair<int, int>>& samples);

}  // namespace sysid
