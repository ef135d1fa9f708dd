#include "sysid/estimation/shooting_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "glog/logging.h"
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

}  // namespace

ShootingProblem::ShootingProblem(const Model& model,
                                 std::vector<FreeParameter> free,
                                 std::vector<Run> runs,
                                 const EstimationOptions& options)
    : model_(model), free_(std::move(free)), options_(options) {
  std::vector<Parameter> parameters;
  for (const FreeParameter& f : free_) parameters.push_back(f.parameter);
  map_ = std::make_unique<ParameterMap>(model_, std::move(parameters));
  const Mechanism& mechanism = model_.mechanism();
  for (Run& run : runs) {
    auto data = std::make_unique<RunData>();
    data->run = std::move(run);
    data->measurements.run = &data->run;
    for (const Channel& channel : data->run.channels) {
      data->measurements.residuals.push_back(
          MakeChannelResidual(mechanism, channel, options_.orientation));
      const bool given = options_.noise > 0 && IsPositionLike(channel.kind);
      data->sigma.push_back(
          given ? options_.noise : ChannelNoise(mechanism, data->run, channel));
    }
    runs_.push_back(std::move(data));
  }
  // One sensor, one noise: the same channel of several runs is pooled.
  for (const auto& a : runs_) {
    for (size_t c = 0; c < a->run.channels.size(); ++c) {
      double sum = 0.0;
      int count = 0;
      for (const auto& b : runs_) {
        for (size_t d = 0; d < b->run.channels.size(); ++d) {
          if (b->run.channels[d].name != a->run.channels[c].name) continue;
          sum += b->sigma[d] * b->sigma[d];
          ++count;
        }
      }
      const double pooled = std::sqrt(sum / count);
      for (const auto& b : runs_) {
        for (size_t d = 0; d < b->run.channels.size(); ++d) {
          if (b->run.channels[d].name == a->run.channels[c].name) {
            b->sigma[d] = pooled;
          }
        }
      }
    }
  }
}

void ShootingProblem::UseNoiseOf(const ShootingProblem& other) {
  for (const auto& data : runs_) {
    for (size_t c = 0; c < data->run.channels.size(); ++c) {
      for (const auto& theirs : other.runs_) {
        for (size_t d = 0; d < theirs->run.channels.size(); ++d) {
          if (theirs->run.channels[d].name == data->run.channels[c].name) {
            data->sigma[c] = theirs->sigma[d];
          }
        }
      }
    }
  }
}

Eigen::VectorXd ShootingProblem::InitialTheta() const {
  Eigen::VectorXd values(free_.size()), theta;
  for (size_t i = 0; i < free_.size(); ++i) values[i] = free_[i].initial;
  if (map_->ThetaOf(values, &theta)) return theta;
  // What a screening expects may be no possible body: the model's own, then. (A
  // start that a user gives is checked where it is read.)
  for (size_t i = 0; i < free_.size(); ++i) {
    values[i] = free_[i].parameter.nominal;
  }
  CHECK(map_->ThetaOf(values, &theta)) << "the model is no possible body";
  return theta;
}

double ShootingProblem::JointSigma(int joint) const {
  for (const auto& data : runs_) {
    for (size_t c = 0; c < data->run.channels.size(); ++c) {
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

double ShootingProblem::PooledNoise() const {
  double sum = 0.0, any = 0.0;
  int count = 0;
  for (const auto& data : runs_) {
    for (size_t c = 0; c < data->run.channels.size(); ++c) {
      any = data->sigma[c];
      if (!IsPositionLike(data->run.channels[c].kind)) continue;
      sum += data->sigma[c] * data->sigma[c];
      ++count;
    }
  }
  return count > 0 ? std::sqrt(sum / count) : any;
}

double ShootingProblem::LongestDuration() const {
  double longest = 0.0;
  for (const auto& data : runs_) {
    longest = std::max(longest, data->run.t.back() - data->run.t.front());
  }
  return longest;
}

double ShootingProblem::MedianSamplePeriod() const {
  std::vector<double> periods;
  for (const auto& data : runs_) {
    const std::vector<double>& t = data->run.t;
    for (size_t k = 1; k < t.size(); ++k) periods.push_back(t[k] - t[k - 1]);
  }
  const auto middle = periods.begin() + periods.size() / 2;
  std::nth_element(periods.begin(), middle, periods.end());
  return *middle;
}

double ShootingProblem::DofPerSample() const {
  double dof = 0.0, samples = 0.0;
  for (const auto& data : runs_) {
    samples += data->run.size();
    for (size_t c = 0; c < data->run.channels.size(); ++c) {
      const auto first = data->run.channels[c].values.col(0);
      dof += ResidualDof(data->measurements.residuals[c]) *
             static_cast<double>((first.array() == first.array()).count());
    }
  }
  return dof / samples;
}

std::vector<SegmentPlace> AllSegments(const ShootingPoint& point) {
  std::vector<SegmentPlace> all;
  for (size_t r = 0; r < point.runs.size(); ++r) {
    for (int k = 0; k < point.runs[r].segments(); ++k) {
      all.push_back({static_cast<int>(r), k});
    }
  }
  return all;
}

std::vector<int> CutRun(const std::vector<double>& t, double length,
                        int min_samples) {
  const int intervals = static_cast<int>(t.size()) - 1;
  const double duration = t.back() - t.front();
  int segments = std::max(1, static_cast<int>(std::lround(duration / length)));
  segments = std::min(segments, std::max(1, intervals / min_samples));
  std::vector<int> samples;
  for (int k = 0; k <= segments; ++k) {
    samples.push_back(
        static_cast<int>(std::lround(double(intervals) * k / segments)));
  }
  return samples;
}

bool SampleStates(const ShootingProblem& problem, const ShootingPoint& point,
                  int run, RowMatrixXd* states) {
  const RunData& data = *problem.runs()[run];
  const ShootingPoint::Nodes& nodes = point.runs[run];
  const int size = problem.model().state_size();
  states->resize(data.run.size(), size);
  const auto roll = [&](int k) {
    const SegmentRollout rollout(
        &problem.model(), &problem.map(), &data.measurements, nodes.samples[k],
        nodes.samples[k + 1], problem.options().rollout);
    std::vector<double> errors(rollout.num_residuals()), x_end(size), visited;
    if (!rollout(nodes.states.row(k).data(), point.theta.data(), errors.data(),
                 x_end.data(), &visited)) {
      return false;
    }
    // The last is where the next begins, whose state counts.
    const bool last = k + 1 == nodes.segments();
    const int count = nodes.samples[k + 1] - nodes.samples[k] + (last ? 1 : 0);
    states->middleRows(nodes.samples[k], count) =
        Eigen::Map<const RowMatrixXd>(visited.data(), count, size);
    return true;
  };
  return ParallelFor(nodes.segments(), problem.options().threads, roll);
}

}  // namespace sysid
