#include "sysid/estimation/evaluation.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "models/math/constants.h"
#include "models/state.h"
#include "residuals/sensed_positions.h"
#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

// Sums of squares by channel name, and over all.
struct Sums {
  double squares = 0.0;  // SI
  double whitened = 0.0;
  double motion = 0.0;  // SI, (8.1)
  double dof = 0.0;

  void operator+=(const Sums& other) {
    squares += other.squares;
    whitened += other.whitened;
    motion += other.motion;
    dof += other.dof;
  }
};

// Those of the channels of a data set, over all processes.
std::vector<Sums> SumOverSegments(
    const ShootingProblem& problem, const std::vector<SegmentPlace>& all,
    const std::vector<std::vector<Sums>>& of_segments) {
  constexpr int kNumbers = 4;
  const DataSet& data = problem.data();
  Totals totals(kNumbers * static_cast<int>(data.channels().size()));
  for (size_t i = 0; i < all.size(); ++i) {
    const Run& run = problem.runs()[all[i].run]->run;
    for (size_t c = 0; c < of_segments[i].size(); ++c) {
      const Sums& sums = of_segments[i][c];
      const int at = kNumbers * data.PlaceOf(run.channels[c].name);
      totals.Add(at, sums.squares);
      totals.Add(at + 1, sums.whitened);
      totals.Add(at + 2, sums.motion);
      totals.Add(at + 3, sums.dof);
    }
  }
  const Eigen::VectorXd numbers = totals.Over(problem.processes());
  std::vector<Sums> by_channel;
  for (int at = 0; at < numbers.size(); at += kNumbers) {
    by_channel.push_back(
        {numbers[at], numbers[at + 1], numbers[at + 2], numbers[at + 3]});
  }
  return by_channel;
}

// (8.1) and (8.2), of mean squares.
double FitPercent(double ratio_squared) {
  return std::isfinite(ratio_squared) ? 100.0 * (1.0 - std::sqrt(ratio_squared))
                                      : std::nan("");
}

double SquaredNorm(const SegmentRow& row, const std::vector<double>& errors) {
  double squares = 0.0;
  for (int i = row.first; i < row.first + row.size; ++i) {
    squares += errors[i] * errors[i];
  }
  return squares;
}

// Of a segment's errors r, per channel of its run.
std::vector<Sums> SumByChannel(const RunData& data,
                               const SegmentRollout& rollout,
                               const std::vector<double>& r) {
  std::vector<Sums> sums(data.run.channels.size());
  for (const SegmentRow& row : rollout.rows()) {
    const double squares = SquaredNorm(row, r);
    const double sigma = data.sigma[row.channel];
    const double motion = data.motion[row.channel];
    const double dof = ResidualDof(data.measurements.residuals[row.channel]);
    sums[row.channel] +=
        {squares, squares / (sigma * sigma), dof * motion * motion, dof};
  }
  return sums;
}

// Rolls segments out by all threads and hands over their errors (SI), which are
// not kept. False where the dynamics of any fail, in any process; the others
// are handed over.
bool RollSegments(
    const ShootingProblem& problem, const Solution& point,
    const std::vector<SegmentPlace>& which,
    const std::function<void(int i, const SegmentRollout& rollout,
                             const std::vector<double>& errors)>& use) {
  std::atomic<bool> failed{false};
  const auto roll = [&](int i) {
    const auto [r, k] = which[i];
    const Solution::Nodes& nodes = point.runs[r];
    const SegmentRollout rollout(
        &problem.model(), &problem.map(), &problem.runs()[r]->measurements,
        nodes.samples[k], nodes.samples[k + 1], point.rollout);
    std::vector<double> errors;
    if (!RollErrors(rollout, nodes.states.row(k).data(), point.theta,
                    &errors)) {
      failed = true;
    } else {
      use(i, rollout, errors);
    }
    return true;
  };
  ParallelFor(static_cast<int>(which.size()), problem.options().threads, roll);
  return AllTrue(problem.processes(), !failed);
}

// The autocorrelation time of series by segment.
double TimeOfSegments(const ShootingProblem& problem, const Solution& point,
                      std::vector<WhitenedSeries> segments) {
  const std::vector<SegmentPlace> all = AllSegments(point);
  std::vector<std::vector<WhitenedSeries>> runs(point.runs.size());
  for (size_t i = 0; i < all.size(); ++i) {
    runs[all[i].run].push_back(std::move(segments[i]));
  }
  return AutocorrelationTime(runs, problem.processes());
}

}  // namespace

bool RollErrors(const SegmentRollout& rollout, const double* x0,
                const Eigen::VectorXd& theta, std::vector<double>* errors) {
  errors->resize(rollout.num_residuals());
  std::vector<double> x_end(rollout.model().state_size());
  return rollout(x0, theta.data(), errors->data(), x_end.data());
}

double ObservedStateDof(const ShootingProblem& problem) {
  double dof = 0.0;
  for (const Body& body : problem.model().movers()) {
    const bool blind =
        body.type == JointType::kSpherical &&
        problem.options().orientation == OrientationResidual::kHeading;
    dof += 2.0 * (blind ? 2 : VelocitySize(body));
  }
  return dof;
}

RunErrors EvaluateErrors(const ShootingProblem& problem, const Solution& point,
                         double fitted, double* correlated) {
  RunErrors errors;
  for (const SensedChannel& channel : problem.data().channels()) {
    errors.channels.push_back({.name = channel.name,
                               .unit = channel.unit,
                               .position_like = IsPositionLike(channel.kind),
                               .noise = channel.sigma});
  }
  const std::vector<SegmentPlace> all = AllSegments(point);
  std::vector<std::vector<Sums>> sums(all.size());
  std::vector<WhitenedSeries> series(all.size());
  const bool failed = !RollSegments(
      problem, point, all,
      [&](int i, const SegmentRollout& rollout, const std::vector<double>& r) {
        const RunData& data = *problem.runs()[all[i].run];
        sums[i] = SumByChannel(data, rollout, r);
        if (correlated) series[i] = WhitenErrors(data, rollout, r.data());
      });
  if (correlated) {
    *correlated =
        failed ? 1.0 : TimeOfSegments(problem, point, std::move(series));
  }
  for (size_t i = 0; i < all.size(); ++i) {
    const RunData& data = *problem.runs()[all[i].run];
    Sums segment;
    for (const Sums& channel : sums[i]) segment += channel;
    if (segment.dof > 0) {
      const std::vector<int>& samples = point.runs[all[i].run].samples;
      const int k = all[i].segment;
      errors.segments.push_back({data.run.name, data.run.t[samples[k]],
                                 data.run.t[samples[k + 1]],
                                 std::sqrt(segment.whitened / segment.dof),
                                 segment.whitened, segment.dof});
    }
  }
  const std::vector<Sums> by_channel = SumOverSegments(problem, all, sums);
  Sums total, position;
  for (size_t c = 0; c < by_channel.size(); ++c) {
    total += by_channel[c];
    if (errors.channels[c].position_like) position += by_channel[c];
  }
  // What was fitted took up this much of the noise, evenly over the samples.
  const double left = std::max(1.0, total.dof - fitted);
  const double inflate = std::sqrt(total.dof / left);
  const auto rms = [&](double squares, double dof) {
    return failed ? kInfinity : inflate * std::sqrt(squares / dof);
  };
  errors.squares = failed ? kInfinity : total.whitened;
  errors.dof = left;
  const Sums& shown = position.dof > 0 ? position : total;
  errors.total.rms = rms(shown.squares, shown.dof);
  errors.total.normalized_rms = rms(total.whitened, total.dof);
  double ratios = 0.0, moving = 0.0;
  for (size_t c = 0; c < by_channel.size(); ++c) {
    ChannelError& channel = errors.channels[c];
    const Sums& sums = by_channel[c];
    channel.rms = rms(sums.squares, sums.dof);
    channel.normalized_rms = rms(sums.whitened, sums.dof);
    const double ratio = inflate * inflate * sums.squares / sums.motion;
    if (!failed) channel.fit_percent = FitPercent(ratio);
    channel.dof = sums.dof;
    if (std::isfinite(ratio) && channel.position_like == (position.dof > 0)) {
      ratios += sums.dof * ratio;
      moving += sums.dof;
    }
  }
  if (!failed) errors.total.fit_percent = FitPercent(ratios / moving);
  std::erase_if(errors.channels,
                [](const ChannelError& channel) { return channel.dof == 0; });
  for (SegmentError& segment : errors.segments) {
    segment.normalized_rms *= inflate;
  }
  return errors;
}

double WeighedSquare(const ShootingProblem& problem, const RunErrors& errors) {
  double squares = 0.0, dof = 0.0;
  for (const ChannelError& channel : errors.channels) {
    const double error = channel.normalized_rms / problem.Misfit(channel.name);
    squares += channel.dof * error * error;
    dof += channel.dof;
  }
  return dof > 0.0 ? squares / dof : 0.0;
}

WhitenedSeries WhitenErrors(const RunData& data, const SegmentRollout& rollout,
                            const double* errors) {
  WhitenedSeries series(data.run.channels.size());
  for (const SegmentRow& row : rollout.rows()) {
    auto& components = series[row.channel];
    components.resize(row.size);
    for (int c = 0; c < row.size; ++c) {
      components[c].push_back(errors[row.first + c] / data.sigma[row.channel]);
    }
  }
  return series;
}

double AutocorrelationTime(const ShootingProblem& problem,
                           const Solution& point) {
  double time = 1.0;
  EvaluateErrors(problem, point, 0.0, &time);
  return time;
}

double AutocorrelationTime(const std::vector<std::vector<WhitenedSeries>>& runs,
                           const Processes& all) {
  Totals totals(2);  // weighted times, and their weights
  for (const std::vector<WhitenedSeries>& segments : runs) {
    WhitenedSeries series;
    for (const WhitenedSeries& part : segments) {
      series.resize(part.size());
      for (size_t c = 0; c < part.size(); ++c) {
        series[c].resize(std::max(series[c].size(), part[c].size()));
        for (size_t i = 0; i < part[c].size(); ++i) {
          series[c][i].insert(series[c][i].end(), part[c][i].begin(),
                              part[c][i].end());
        }
      }
    }
    for (const auto& components : series) {
      for (const std::vector<double>& e : components) {
        double variance = 0.0;
        for (const double x : e) variance += x * x;
        if (!(variance > 0)) continue;
        double time = 1.0;
        for (size_t lag = 1; lag < e.size() / 2; ++lag) {
          double product = 0.0;
          for (size_t i = lag; i < e.size(); ++i) product += e[i] * e[i - lag];
          // Two standard errors of a white series: below that it is chance.
          if (product / variance < 2.0 / std::sqrt(double(e.size()))) break;
          time += 2.0 * product / variance;
        }
        totals.Add(0, time * variance);
        totals.Add(1, variance);
      }
    }
  }
  const Eigen::VectorXd sums = totals.Over(all);
  return sums[1] > 0 ? sums[0] / sums[1] : 1.0;
}

std::vector<OpenError> EvaluateOpen(const ShootingProblem& problem,
                                    const Solution& point) {
  std::vector<OpenError> result;
  for (size_t r = 0; r < point.runs.size(); ++r) {
    const RunData& data = *problem.runs()[r];
    const SegmentRollout rollout(&problem.model(), &problem.map(),
                                 &data.measurements, 0, data.run.size() - 1,
                                 point.rollout);
    std::vector<double> errors;
    const bool ok = RollErrors(rollout, point.runs[r].states.row(0).data(),
                               point.theta, &errors);
    OpenError open;
    open.trajectory = data.run.name;
    open.duration_s = data.run.t.back() - data.run.t.front();
    std::vector<Sums> sums(data.run.channels.size());
    for (const SegmentRow& row : rollout.rows()) {
      double norm2 = SquaredNorm(row, errors);
      const ChannelResidual& residual =
          data.measurements.residuals[row.channel];
      if (std::holds_alternative<PlanarHeadingResidual>(residual) ||
          std::holds_alternative<HeadingResidual>(residual)) {
        // Unit vectors at the angle e are 2 sin(e/2) apart.
        const double angle =
            2.0 * std::asin(std::min(1.0, 0.5 * std::sqrt(norm2)));
        norm2 = angle * angle;
      }
      const double motion = data.motion[row.channel];
      sums[row.channel] += {.squares = norm2,
                            .motion = ResidualDof(residual) * motion * motion,
                            .dof = 1.0};
    }
    for (size_t c = 0; c < data.run.channels.size(); ++c) {
      if (sums[c].dof == 0) continue;
      const Channel& channel = data.run.channels[c];
      open.channels.push_back(
          {channel.name, ResidualUnit(problem.model().mechanism(), channel),
           ok ? std::sqrt(sums[c].squares / sums[c].dof) : kInfinity,
           ok ? FitPercent(sums[c].squares / sums[c].motion) : std::nan("")});
    }
    result.push_back(std::move(open));
  }
  return result;
}

std::vector<RowMatrixXd> PredictChannels(const ShootingProblem& problem,
                                         const Solution& point, int run,
                                         const RowMatrixXd& states) {
  const Model& model = problem.model();
  const StateLayout& at = model.layout();
  const Run& recording = problem.runs()[run]->run;
  MechanismParameters<double> values;
  problem.map().Apply<double>(point.theta.data(), &values);
  Workspace<double> ws(model);
  ws.SetParameters(values);
  SensedPositions<double> sensed(point.rollout.integrator, &ws);
  std::vector<RowMatrixXd> predicted;
  for (const Channel& channel : recording.channels) {
    predicted.emplace_back(recording.size(), channel.values.cols());
  }
  for (int k = 0; k < recording.size(); ++k) {
    const double* x = states.row(k).data();
    const double* q = x + at.q();
    const double* seen = sensed(recording, k, x);
    const double* motors = sensed.OfMotors(x);
    ForwardKinematics<double>(&ws, q);
    for (size_t c = 0; c < recording.channels.size(); ++c) {
      const Channel& channel = recording.channels[c];
      const int columns = static_cast<int>(channel.values.cols());
      if (channel.kind == ChannelKind::kFramePosition) {
        predicted[c].row(k) =
            LinkPosition<double>(ws, channel.target)(channel.axes).transpose();
        continue;
      }
      const Joint& joint = model.mechanism().joints[channel.target];
      const double* from = channel.kind == ChannelKind::kMotorPosition
                               ? motors + joint.q_index
                           : IsPositionLike(channel.kind) ? seen + joint.q_index
                                                          : x + at.qd(joint);
      predicted[c].row(k) = Eigen::Map<const Eigen::RowVectorXd>(from, columns);
    }
  }
  return predicted;
}

}  // namespace sysid
