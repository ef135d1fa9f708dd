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

namespace {

// A column where it was measured; `follow` says what a value is after another.
template <typename Follow>
Series ReadColumn(const Run& run, const Channel& channel, int slot,
                  const Follow& follow) {
  Series series;
  series.run = &run;
  series.channel = &channel;
  for (int k = 0; k < run.size(); ++k) {
    const double value = channel.values(k, slot);
    if (std::isnan(value)) continue;
    series.y.push_back(series.y.empty() ? value
                                        : follow(value, series.y.back()));
    series.t.push_back(run.t[k]);
  }
  return series;
}

double Unwrapped(double value, double last) {
  const double turns = (value - last) / (2 * M_PI);
  // Only whole turns are the sensor's: half of one is a jump, and so are more
  // than 16 bits count.
  const bool whole = std::abs(turns - std::round(turns)) < 0.2 &&
                     std::abs(turns) < (1 << 16) + 0.5;
  return whole ? value - 2 * M_PI * std::round(turns) : value;
}

// The four of a quaternion, each row of the sign nearer to the row before.
std::vector<Series> Components(const Run& run, const Channel& channel) {
  std::vector<Series> parts(4);
  Eigen::Vector4d last = Eigen::Vector4d::Zero();
  for (Series& part : parts) {
    part.run = &run;
    part.channel = &channel;
  }
  for (int k = 0; k < run.size(); ++k) {
    Eigen::Vector4d now = channel.values.row(k);
    if (now.hasNaN()) continue;
    if (now.dot(last) < 0.0) now = -now;
    for (int c = 0; c < 4; ++c) {
      parts[c].t.push_back(run.t[k]);
      parts[c].y.push_back(now[c]);
    }
    last = now;
  }
  return parts;
}

void Describe(Series* series) {
  const auto [low, high] =
      std::minmax_element(series->y.begin(), series->y.end());
  series->range = *high - *low;
  series->noise = EstimateNoise(series->t, series->y);
  std::vector<double> steps;
  for (size_t k = 1; k < series->y.size(); ++k) {
    steps.push_back(std::abs(series->y[k] - series->y[k - 1]));
  }
  series->step = Percentile(std::move(steps), 0.95);
}

}  // namespace

std::vector<Series> AllSeries(const CheckInput& input) {
  const Mechanism& mechanism = input.model->mechanism();
  std::vector<Series> all;
  for (const Run* run : input.runs) {
    for (const Channel& channel : run->channels) {
      if (channel.kind == ChannelKind::kOrientation) continue;
      const ColumnGroup group = GroupOf(mechanism, channel);
      const bool wraps = IsScalarPosition(channel.kind) &&
                         IsRotation1(mechanism.joints[channel.target].type);
      for (size_t c = 0; c < group.columns.size(); ++c) {
        Series series = ReadColumn(
            *run, channel, group.slots[c], [&](double value, double last) {
              return wraps ? Unwrapped(value, last) : value;
            });
        series.column = group.columns[c];
        if (series.y.size() < 5) continue;
        Describe(&series);
        all.push_back(std::move(series));
      }
    }
  }
  return all;
}

std::vector<Series> MotionSeries(const CheckInput& input) {
  std::vector<Series> all = AllSeries(input);
  for (const Run* run : input.runs) {
    for (const Channel& channel : run->channels) {
      if (channel.kind != ChannelKind::kOrientation) continue;
      std::vector<Series> parts = Components(*run, channel);
      if (parts.front().y.size() < 5) continue;
      double range = 0.0, noise = 0.0;
      for (Series& part : parts) {
        part.column =
            input.model->mechanism().joints[channel.target].name + ".q";
        Describe(&part);
        range = std::max(range, part.range);
        noise = std::max(noise, part.noise);
      }
      for (Series& part : parts) {
        part.range = range;
        part.noise = noise;
        all.push_back(std::move(part));
      }
    }
  }
  return all;
}

std::vector<double> AsRead(const Series& series) {
  std::vector<double> numbers;
  for (const double number : series.channel->values.col(0)) {
    if (!std::isnan(number)) numbers.push_back(number);
  }
  return numbers;
}

bool IsBeyondLimits(const Series& series, const Joint& joint) {
  constexpr double kBeyond = 0.25;
  // Limits of a continuous joint mean nothing in a URDF.
  const bool limited = joint.has_limits && joint.lower < joint.upper &&
                       (joint.type == JointType::kRevolute ||
                        joint.type == JointType::kPrismatic);
  const double slack = kBeyond * (joint.upper - joint.lower);
  if (!limited || series.channel->kind != ChannelKind::kPosition) return false;
  const std::vector<double> q = AsRead(series);
  return Percentile(q, 0.01) < joint.lower - slack ||
         Percentile(q, 0.99) > joint.upper + slack;
}

Finding At(const Run& run, const std::string& subject, const std::string& fault,
           Severity severity) {
  Finding finding;
  finding.fault = fault;
  finding.severity = severity;
  finding.file = run.name;
  finding.subject = subject;
  return finding;
}

Finding At(const Series& series, const std::string& fault, Severity severity) {
  return At(*series.run, series.column, fault, severity);
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

double RadianTime(const std::vector<const Run*>& runs) {
  constexpr double kStride = 0.1;  // s: longer than noise, shorter than motions
  std::vector<double> times;
  for (const Run* run : runs) {
    const double period = MedianPeriod(run->t);
    const int h = std::max(1, static_cast<int>(kStride / period));
    for (const Channel& channel : run->channels) {
      if (!IsPositionLike(channel.kind)) continue;
      for (int c = 0; c < channel.values.cols(); ++c) {
        const auto y = channel.values.col(c);
        std::vector<double> first, second;
        for (int k = 2 * h; k < run->size(); ++k) {
          const double change = y[k] - 2.0 * y[k - h] + y[k - 2 * h];
          if (std::isnan(change)) continue;
          first.push_back(y[k] - y[k - h]);
          second.push_back(std::abs(change));
        }
        if (first.empty()) continue;
        const double middle = Median(first);
        for (double& value : first) value = std::abs(value - middle);
        const double bend = Median(second);
        if (bend > 0.0) times.push_back(h * period * Median(first) / bend);
      }
    }
  }
  return times.empty() ? 0.0 : Median(times);
}

void SumsOfLine::Add(double t, const Eigen::RowVectorXd& y) {
  if (n_++ == 0) {
    y_ = Eigen::RowVectorXd::Zero(y.size());
    yy_ = ty_ = y_;
    first_t_ = t;
    first_y_ = y;
  }
  const double s = t - first_t_;
  const Eigen::RowVectorXd d = y - first_y_;
  t_ += s;
  tt_ += s * s;
  y_ += d;
  yy_ += d.cwiseAbs2();
  ty_ += s * d;
}

double SumsOfLine::AboutLine() const {
  if (n_ < 3) return 0.0;
  const double stt = tt_ - t_ * t_ / n_;
  const Eigen::RowVectorXd sty = ty_ - t_ * y_ / n_;
  const Eigen::RowVectorXd syy = yy_ - y_.cwiseAbs2() / n_;
  return std::max(0.0, (syy - sty.cwiseAbs2() / stt).sum());
}

}  // namespace sysid
