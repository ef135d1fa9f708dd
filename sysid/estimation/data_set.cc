#include "sysid/estimation/data_set.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "sysid/estimation/noise.h"
#include "sysid/estimation/parallel.h"

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
  const bool wraps = IsScalarPosition(channel.kind) &&
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
    const double mean = sum / count;
    for (const double value : y) {
      if (!std::isnan(value)) squares += std::pow(value - mean, 2);
    }
    // Of equal numbers the rounding of their mean is left.
    constexpr double kRounding = 1e-14;
    if (squares > count * std::pow(kRounding * count * mean, 2)) {
      variance += squares / count;
    }
  }
  return std::sqrt(variance / ResidualDof(residual));
}

// The channels of all runs, with what is needed to pool them: a run counts by
// the samples that tell of its noise.
struct PooledChannel {
  SensedChannel channel;  // with the largest sigma of the runs
  LongSum squares;        // of the sigmas, each times its count
  double count = 0.0;
};

// How many samples of a channel tell of its noise: what is left of them by the
// fewest windows of EstimateNoise, which needs five.
double NoiseCount(const Channel& channel) {
  const auto first = channel.values.col(0);
  const double valid =
      static_cast<double>((first.array() == first.array()).count());
  return std::max(0.0, valid - 4.0);
}

// Of one process, as text for the others.
std::string Packed(const std::vector<PooledChannel>& channels) {
  Packer packer;
  for (const PooledChannel& one : channels) {
    packer.Put(one.channel.name);
    packer.Put(one.channel.unit);
    packer.Put(static_cast<double>(one.channel.kind));
    packer.Put(one.channel.target);
    packer.Put(one.channel.sigma);
    packer.Put(one.squares.high);
    packer.Put(one.squares.low);
    packer.Put(one.count);
  }
  return packer.bytes();
}

// Adds the channels of a process to those of the ones before it.
void AddPacked(const std::string& bytes, std::vector<PooledChannel>* all,
               std::map<std::string, int>* places) {
  for (Unpacker unpacker(bytes); !unpacker.AtEnd();) {
    PooledChannel one;
    one.channel.name = unpacker.Text();
    one.channel.unit = unpacker.Text();
    one.channel.kind = static_cast<ChannelKind>(unpacker.Count());
    one.channel.target = unpacker.Count();
    one.channel.sigma = unpacker.Number();
    one.squares.high = unpacker.Number();
    one.squares.low = unpacker.Number();
    one.count = unpacker.Number();
    const auto [at, is_new] =
        places->emplace(one.channel.name, static_cast<int>(all->size()));
    if (is_new) {
      all->push_back(std::move(one));
    } else {
      PooledChannel& of_others = (*all)[at->second];
      of_others.channel.sigma =
          std::max(of_others.channel.sigma, one.channel.sigma);
      of_others.squares += one.squares;
      of_others.count += one.count;
    }
  }
}

// Of the runs of this process, in the order of their first appearance.
std::vector<PooledChannel> ChannelsOf(
    const Mechanism& mechanism,
    const std::vector<std::unique_ptr<RunData>>& runs) {
  std::vector<PooledChannel> channels;
  std::map<std::string, size_t> places;
  for (const auto& data : runs) {
    for (size_t c = 0; c < data->run.channels.size(); ++c) {
      const Channel& channel = data->run.channels[c];
      const auto [at, is_new] = places.emplace(channel.name, channels.size());
      if (is_new) {
        channels.push_back({{channel.name, ResidualUnit(mechanism, channel),
                             channel.kind, channel.target},
                            {},
                            0.0});
      }
      PooledChannel& one = channels[at->second];
      const double count = NoiseCount(channel);
      one.channel.sigma = std::max(one.channel.sigma, data->sigma[c]);
      one.squares += count * data->sigma[c] * data->sigma[c];
      one.count += count;
    }
  }
  return channels;
}

std::vector<std::unique_ptr<RunData>> MakeRuns(
    const Mechanism& mechanism, std::vector<Run> runs,
    const MeasurementOptions& options) {
  std::vector<std::unique_ptr<RunData>> all;
  std::vector<std::pair<RunData*, size_t>> channels;
  for (Run& run : runs) {
    auto data = std::make_unique<RunData>();
    data->run = std::move(run);
    data->measurements.run = &data->run;
    for (const Channel& channel : data->run.channels) {
      channels.emplace_back(data.get(), data->measurements.residuals.size());
      data->measurements.residuals.push_back(
          MakeChannelResidual(mechanism, channel, options.orientation));
    }
    data->sigma.resize(data->run.channels.size());
    data->motion.resize(data->run.channels.size());
    all.push_back(std::move(data));
  }
  ParallelFor(static_cast<int>(channels.size()), options.threads, [&](int i) {
    const auto [data, c] = channels[i];
    const Channel& channel = data->run.channels[c];
    const bool given = options.noise > 0 && IsPositionLike(channel.kind);
    data->sigma[c] =
        given ? options.noise : ChannelNoise(mechanism, data->run, channel);
    data->motion[c] =
        ChannelMotion(mechanism, channel, data->measurements.residuals[c]);
    return true;
  });
  return all;
}

}  // namespace

DataSet::DataSet(const Mechanism& mechanism, std::vector<Run> runs,
                 const MeasurementOptions& options, const DataSet* like)
    : options_(options) {
  const Processes& all = ProcessesOf(options);
  std::vector<std::unique_ptr<RunData>> own =
      MakeRuns(mechanism, std::move(runs), options);
  // One sensor, one noise: the same channel of several runs is pooled. One with
  // too few samples to tell has that of the other joints, of its kind and unit.
  std::vector<PooledChannel> pooled;
  for (const std::string& bytes :
       GatherToAll(all, Packed(ChannelsOf(mechanism, own)))) {
    AddPacked(bytes, &pooled, &places_);
  }
  double squares = 0.0, count = 0.0;
  std::vector<int> untold;
  for (PooledChannel& one : pooled) {
    double& sigma = one.channel.sigma;
    const bool given = options.noise > 0 && IsPositionLike(one.channel.kind);
    if (like != nullptr && like->places_.contains(one.channel.name)) {
      sigma = like->channels_[like->PlaceOf(one.channel.name)].sigma;
    } else if (one.count > 0.0) {
      sigma = std::sqrt(one.squares.Value() / one.count);
    } else if (!given) {
      untold.push_back(static_cast<int>(channels_.size()));
    }
    channels_.push_back(one.channel);
    if (!IsPositionLike(one.channel.kind)) continue;
    squares += one.count * sigma * sigma;
    count += one.count;
  }
  for (const int c : untold) {
    double like_squares = 0.0, like_count = 0.0;
    for (const PooledChannel& one : pooled) {
      if (one.channel.kind != channels_[c].kind ||
          one.channel.unit != channels_[c].unit) {
        continue;
      }
      like_squares += one.squares.Value();
      like_count += one.count;
    }
    if (like_count > 0.0) {
      channels_[c].sigma = std::sqrt(like_squares / like_count);
    }
  }
  pooled_ = count > 0.0         ? std::sqrt(squares / count)
            : channels_.empty() ? 0.0
                                : channels_.back().sigma;
  for (auto& data : own) {
    for (size_t c = 0; c < data->sigma.size(); ++c) {
      data->sigma[c] = channels_[PlaceOf(data->run.channels[c].name)].sigma;
    }
    runs_.push_back(std::move(data));
  }
  Measure(all);
}

std::shared_ptr<const DataSet> DataSet::Part(double samples) const {
  auto part = std::make_shared<DataSet>(*this);
  const double share = std::min(1.0, samples / std::max(1, samples_));
  part->runs_.clear();
  for (size_t r = 0; r < runs_.size(); ++r) {
    const double place = first_run_ + static_cast<double>(r);
    if (std::ceil(share * (place + 1.0)) > std::ceil(share * place)) {
      part->runs_.push_back(runs_[r]);
    }
  }
  part->Measure(ProcessesOf(options_));
  return part;
}

void DataSet::Measure(const Processes& all) {
  std::vector<double> counts(all.size(), 0.0);  // of runs, by rank
  counts[all.rank()] = static_cast<double>(runs_.size());
  all.Max(&counts);
  run_count_ = first_run_ = 0;
  for (int p = 0; p < all.size(); ++p) {
    if (p < all.rank()) first_run_ += static_cast<int>(counts[p]);
    run_count_ += static_cast<int>(counts[p]);
  }
  longest_ = dof_per_sample_ = 0.0;
  std::vector<double> periods;
  Totals totals(3);
  for (const auto& data : runs_) {
    const std::vector<double>& t = data->run.t;
    totals.Add(0, data->run.size());
    totals.Add(1, t.back() - t.front());
    longest_ = std::max(longest_, t.back() - t.front());
    for (size_t k = 1; k < t.size(); ++k) periods.push_back(t[k] - t[k - 1]);
    for (size_t c = 0; c < data->run.channels.size(); ++c) {
      const auto first = data->run.channels[c].values.col(0);
      totals.Add(
          2, ResidualDof(data->measurements.residuals[c]) *
                 static_cast<double>((first.array() == first.array()).count()));
    }
  }
  const Eigen::VectorXd sums = totals.Over(all);
  samples_ = static_cast<int>(sums[0]);
  duration_ = sums[1];
  if (samples_ > 0) dof_per_sample_ = sums[2] / sums[0];
  longest_ = MaxOver(all, longest_);
  period_ = MedianOver(all, std::move(periods));
}

const SensedChannel* DataSet::SensorOf(int joint) const {
  const SensedChannel* motor = nullptr;
  for (const SensedChannel& channel : channels_) {
    if (channel.target != joint) continue;
    if (channel.kind == ChannelKind::kPosition ||
        channel.kind == ChannelKind::kOrientation) {
      return &channel;
    }
    if (channel.kind == ChannelKind::kMotorPosition) motor = &channel;
  }
  return motor;
}

double DataSet::JointSigma(int joint) const {
  const SensedChannel* sensor = SensorOf(joint);
  return sensor != nullptr ? sensor->sigma : PooledNoise();
}

std::vector<Run> RunsOf(const DataSet& data) {
  std::vector<Run> runs;
  for (const auto& one : data.runs()) runs.push_back(one->run);
  return runs;
}

}  // namespace sysid
