#include "sysid/estimation/data_set.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "sysid/estimation/noise.h"

namespace sysid {
namespace {

// Below this part of its range a channel is taken as exact to rounding: a
// smaller noise would ask of the integrator what doubles cannot give.
constexpr double kNoiseFloor = 1e-6;

// The channel's numbers as smooth functions of time: angles unwrapped,
// quaternions as the components of the residual that compares them.
std::vector<std::vector<double>> SmoothComponents(const Mechanism& mechanism,
                                                  const Channel& channel) {
  const int samples = static_cast<int>(channel.values.rows());
  const int columns = static_cast<int>(channel.values.cols());
  std::vector<std::vector<double>> components;
  if (channel.kind == ChannelKind::kOrientation) {
    const Eigen::Vector3d axis =
        LinkAxis(mechanism, mechanism.joints[channel.target].child_link);
    components.assign(3, std::vector<double>(samples));
    for (int k = 0; k < samples; ++k) {
      const Eigen::Quaterniond q(channel.values(k, 3), channel.values(k, 0),
                                 channel.values(k, 1), channel.values(k, 2));
      const Eigen::Vector3d z = ToMatrix(q) * axis;
      for (int c = 0; c < 3; ++c) components[c][k] = z[c];
    }
    return components;
  }
  const bool wraps = channel.kind == ChannelKind::kPosition &&
                     IsRotation1(mechanism.joints[channel.target].type);
  components.assign(columns, std::vector<double>(samples));
  for (int c = 0; c < columns; ++c) {
    double before = std::numeric_limits<double>::quiet_NaN();
    for (int k = 0; k < samples; ++k) {
      double value = channel.values(k, c);
      if (wraps && !std::isnan(before) && !std::isnan(value)) {
        value -= 2 * M_PI * std::round((value - before) / (2 * M_PI));
      }
      if (!std::isnan(value)) before = value;
      components[c][k] = value;
    }
  }
  return components;
}

// Quaternions, each with the sign that is nearer to the one before.
RowMatrixXd Continuous(RowMatrixXd quaternions) {
  Eigen::RowVectorXd before = Eigen::RowVectorXd::Zero(quaternions.cols());
  for (auto row : quaternions.rowwise()) {
    if (row.hasNaN()) continue;
    if (row.dot(before) < 0.0) row = -row;
    before = row;
  }
  return quaternions;
}

double ChannelNoise(const Mechanism& mechanism, const Run& run,
                    const Channel& channel) {
  const auto components = SmoothComponents(mechanism, channel);
  double sum = 0.0, range = 0.0;
  for (const std::vector<double>& y : components) {
    const double sigma = EstimateNoise(run.t, y);
    sum += sigma * sigma;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const double value : y) {
      if (std::isnan(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    if (high > low) range = std::max(range, high - low);
  }
  // A unit vector in space moves in two of its three components.
  const double dof = channel.kind == ChannelKind::kOrientation
                         ? 2.0
                         : static_cast<double>(components.size());
  return std::max({std::sqrt(sum / dof), kNoiseFloor * range, 1e-12});
}

// (8.1) of a channel. Two rotations of which one is turned by a small angle e
// against the other differ by e / 2 as quaternions.
double ChannelMotion(const Mechanism& mechanism, const Channel& channel,
                     const ChannelResidual& residual) {
  std::vector<std::vector<double>> components;
  if (std::holds_alternative<RotationResidual>(residual)) {
    const RowMatrixXd turned = 2.0 * Continuous(channel.values);
    for (const auto& column : turned.colwise()) {
      components.emplace_back(column.begin(), column.end());
    }
  } else {
    components = SmoothComponents(mechanism, channel);
  }
  double variance = 0.0;
  for (const std::vector<double>& y : components) {
    double sum = 0.0, squares = 0.0;
    int count = 0;
    for (const double value : y) {
      if (std::isnan(value)) continue;
      sum += value;
      ++count;
    }
    for (const double value : y) {
      if (!std::isnan(value)) squares += std::pow(value - sum / count, 2);
    }
    variance += squares / count;
  }
  return std::sqrt(variance / ResidualDof(residual));
}

// One sensor, one noise: the same channel of several runs is pooled.
void PoolNoise(std::vector<std::unique_ptr<RunData>>* runs) {
  struct Sum {
    double squares = 0.0;
    int count = 0;
  };
  std::map<std::string, Sum> sums;
  for (const auto& data : *runs) {
    for (size_t c = 0; c < data->run.channels.size(); ++c) {
      Sum& sum = sums[data->run.channels[c].name];
      sum.squares += data->sigma[c] * data->sigma[c];
      ++sum.count;
    }
  }
  for (const auto& data : *runs) {
    for (size_t c = 0; c < data->run.channels.size(); ++c) {
      const Sum& sum = sums[data->run.channels[c].name];
      data->sigma[c] = std::sqrt(sum.squares / sum.count);
    }
  }
}

// The sigma of a channel of this name; NaN where none has it.
double SigmaOf(const DataSet& data, const std::string& channel) {
  for (const auto& run : data.runs()) {
    for (size_t c = 0; c < run->run.channels.size(); ++c) {
      if (run->run.channels[c].name == channel) return run->sigma[c];
    }
  }
  return std::numeric_limits<double>::quiet_NaN();
}

// Of `like` where it has the channels, else estimated and pooled.
std::vector<std::unique_ptr<RunData>> MakeRuns(
    const Mechanism& mechanism, std::vector<Run> runs,
    const MeasurementOptions& options, const DataSet* like) {
  std::vector<std::unique_ptr<RunData>> all;
  for (Run& run : runs) {
    auto data = std::make_unique<RunData>();
    data->run = std::move(run);
    data->measurements.run = &data->run;
    for (const Channel& channel : data->run.channels) {
      data->measurements.residuals.push_back(
          MakeChannelResidual(mechanism, channel, options.orientation));
      const bool given = options.noise > 0 && IsPositionLike(channel.kind);
      data->sigma.push_back(
          given ? options.noise : ChannelNoise(mechanism, data->run, channel));
      data->motion.push_back(ChannelMotion(
          mechanism, channel, data->measurements.residuals.back()));
    }
    all.push_back(std::move(data));
  }
  PoolNoise(&all);
  if (like == nullptr) return all;
  for (const auto& data : all) {
    for (size_t c = 0; c < data->run.channels.size(); ++c) {
      const double theirs = SigmaOf(*like, data->run.channels[c].name);
      if (!std::isnan(theirs)) data->sigma[c] = theirs;
    }
  }
  return all;
}

}  // namespace

DataSet::DataSet(const Mechanism& mechanism, std::vector<Run> runs,
                 const MeasurementOptions& options, const DataSet* like)
    : options_(options) {
  for (auto& data : MakeRuns(mechanism, std::move(runs), options, like)) {
    runs_.push_back(std::move(data));
  }
  std::vector<double> periods;
  double dof = 0.0;
  for (const auto& data : runs_) {
    const std::vector<double>& t = data->run.t;
    samples_ += data->run.size();
    longest_ = std::max(longest_, t.back() - t.front());
    duration_ += t.back() - t.front();
    for (size_t k = 1; k < t.size(); ++k) periods.push_back(t[k] - t[k - 1]);
    for (size_t c = 0; c < data->run.channels.size(); ++c) {
      const auto first = data->run.channels[c].values.col(0);
      dof += ResidualDof(data->measurements.residuals[c]) *
             static_cast<double>((first.array() == first.array()).count());
    }
  }
  if (samples_ > 0) dof_per_sample_ = dof / samples_;
  if (periods.empty()) return;
  const auto middle = periods.begin() + periods.size() / 2;
  std::nth_element(periods.begin(), middle, periods.end());
  period_ = *middle;
}

double DataSet::JointSigma(int joint) const {
  for (const auto& data : runs_) {
    for (size_t c = 0; c < data->sigma.size(); ++c) {
      const Channel& channel = data->run.channels[c];
      if (channel.target == joint &&
          (channel.kind == ChannelKind::kPosition ||
           channel.kind == ChannelKind::kOrientation)) {
        return data->sigma[c];
      }
    }
  }
  return PooledNoise();
}

double DataSet::PooledNoise() const {
  double sum = 0.0, any = 0.0;
  int count = 0;
  for (const auto& data : runs_) {
    for (size_t c = 0; c < data->sigma.size(); ++c) {
      any = data->sigma[c];
      if (!IsPositionLike(data->run.channels[c].kind)) continue;
      sum += data->sigma[c] * data->sigma[c];
      ++count;
    }
  }
  return count > 0 ? std::sqrt(sum / count) : any;
}

std::vector<Run> RunsOf(const DataSet& data) {
  std::vector<Run> runs;
  for (const auto& one : data.runs()) runs.push_back(one->run);
  return runs;
}

}  // namespace sysid
