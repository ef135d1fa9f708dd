#include "sysid/estimation/evaluation.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "models/state.h"
#include "sysid/estimation/horizon.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/parallel.h"
#include "sysid/estimation/segmentation.h"

namespace sysid {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Sums of squares by channel name, and over all.
struct Sums {
  double squares = 0.0;  // SI
  double whitened = 0.0;
  double dof = 0.0;

  void operator+=(const Sums& other) {
    squares += other.squares;
    whitened += other.whitened;
    dof += other.dof;
  }
};

// Of a segment's errors r, per channel of its run.
std::vector<Sums> SumByChannel(const RunData& data,
                               const SegmentRollout& rollout,
                               const std::vector<double>& r) {
  std::vector<Sums> sums(data.run.channels.size());
  for (const SegmentRow& row : rollout.rows()) {
    double squares = 0.0;
    for (int i = 0; i < row.size; ++i) {
      squares += r[row.first + i] * r[row.first + i];
    }
    const double sigma = data.sigma[row.channel];
    sums[row.channel] +=
        {squares, squares / (sigma * sigma),
         1.0 * ResidualDof(data.measurements.residuals[row.channel])};
  }
  return sums;
}

// Rolls segments out by all threads and hands over their errors (SI), which are
// not kept. False where the dynamics of any fail; the others are handed over.
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
    std::vector<double> errors(rollout.num_residuals());
    std::vector<double> x_end(problem.model().state_size());
    if (!rollout(nodes.states.row(k).data(), point.theta.data(), errors.data(),
                 x_end.data())) {
      failed = true;
    } else {
      use(i, rollout, errors);
    }
    return true;
  };
  ParallelFor(static_cast<int>(which.size()), problem.options().threads, roll);
  return !failed;
}

}  // namespace

double ObservedStateDof(const ShootingProblem& problem) {
  double dof = 0.0;
  for (const Body& body : problem.model().bodies()) {
    const bool blind =
        body.type == JointType::kSpherical &&
        problem.options().orientation == OrientationResidual::kHeading;
    dof += 2.0 * (blind ? 2 : VelocitySize(body.type));
  }
  return dof;
}

RunErrors EvaluateErrors(const ShootingProblem& problem, const Solution& point,
                         double fitted) {
  RunErrors errors;
  std::vector<std::string> order;
  std::map<std::string, Sums> by_channel;
  std::map<std::string, ChannelError> described;
  Sums total, position;
  for (size_t r = 0; r < point.runs.size(); ++r) {
    const RunData& data = *problem.runs()[r];
    for (size_t c = 0; c < data.run.channels.size(); ++c) {
      const Channel& channel = data.run.channels[c];
      if (described.count(channel.name) > 0) continue;
      order.push_back(channel.name);
      described[channel.name] = {
          channel.name, ResidualUnit(problem.model().mechanism(), channel), 0,
          0, data.sigma[c]};
    }
  }
  const std::vector<SegmentPlace> all = AllSegments(point);
  std::vector<std::vector<Sums>> sums(all.size());
  const bool failed = !RollSegments(
      problem, point, all,
      [&](int i, const SegmentRollout& rollout, const std::vector<double>& r) {
        sums[i] = SumByChannel(*problem.runs()[all[i].run], rollout, r);
      });
  for (size_t i = 0; i < all.size(); ++i) {
    const RunData& data = *problem.runs()[all[i].run];
    Sums segment;
    for (size_t c = 0; c < sums[i].size(); ++c) {
      const Channel& channel = data.run.channels[c];
      segment += sums[i][c];
      total += sums[i][c];
      by_channel[channel.name] += sums[i][c];
      if (IsPositionLike(channel.kind)) position += sums[i][c];
    }
    if (segment.dof > 0) {
      const std::vector<int>& samples = point.runs[all[i].run].samples;
      const int k = all[i].segment;
      errors.segments.push_back({data.run.name, data.run.t[samples[k]],
                                 data.run.t[samples[k + 1]],
                                 std::sqrt(segment.whitened / segment.dof)});
    }
  }
  // What was fitted took up this much of the noise, evenly over the samples.
  const double left = std::max(1.0, total.dof - fitted);
  const double inflate = std::sqrt(total.dof / left);
  errors.squares = failed ? kInfinity : total.whitened;
  errors.dof = left;
  const Sums& shown = position.dof > 0 ? position : total;
  errors.total.rms =
      failed ? kInfinity : inflate * std::sqrt(shown.squares / shown.dof);
  errors.total.normalized_rms =
      failed ? kInfinity : inflate * std::sqrt(total.whitened / total.dof);
  for (const std::string& name : order) {
    ChannelError channel = described[name];
    const Sums& sums = by_channel[name];
    if (sums.dof == 0) continue;
    channel.rms =
        failed ? kInfinity : inflate * std::sqrt(sums.squares / sums.dof);
    channel.normalized_rms =
        failed ? kInfinity : inflate * std::sqrt(sums.whitened / sums.dof);
    errors.channels.push_back(channel);
  }
  for (SegmentError& segment : errors.segments) {
    segment.normalized_rms *= inflate;
  }
  return errors;
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
  const std::vector<SegmentPlace> all = AllSegments(point);
  std::vector<WhitenedSeries> parts(all.size());
  const auto whiten = [&](int i, const SegmentRollout& rollout,
                          const std::vector<double>& errors) {
    parts[i] =
        WhitenErrors(*problem.runs()[all[i].run], rollout, errors.data());
  };
  if (!RollSegments(problem, point, all, whiten)) return 1.0;
  std::vector<std::vector<WhitenedSeries>> runs(point.runs.size());
  for (size_t i = 0; i < all.size(); ++i) {
    runs[all[i].run].push_back(std::move(parts[i]));
  }
  return AutocorrelationTime(runs);
}

double AutocorrelationTime(
    const std::vector<std::vector<WhitenedSeries>>& runs) {
  double weighted = 0.0, weight = 0.0;
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
        weighted += time * variance;
        weight += variance;
      }
    }
  }
  return weight > 0 ? weighted / weight : 1.0;
}

std::vector<HorizonError> EvaluateHorizon(const ShootingProblem& problem,
                                          const Solution& solution) {
  const Eigen::VectorXd& theta = solution.theta;
  Solution windows =
      CutPoint(problem, theta, AllStatesFromData(problem), kHorizonWindow);
  windows.rollout = solution.rollout;
  std::vector<SegmentPlace> starts;
  std::vector<double> reach;  // of each
  for (size_t r = 0; r < problem.runs().size(); ++r) {
    std::vector<int> samples = windows.runs[r].samples;
    samples.pop_back();
    const std::vector<double> all =
        HorizonReach(problem.runs()[r]->run.t, samples);
    for (size_t k = 0; k < all.size(); ++k) {
      if (all[k] == 0.0) continue;
      starts.push_back({static_cast<int>(r), static_cast<int>(k)});
      reach.push_back(all[k]);
    }
  }
  windows = SolveOneByOne(problem, {.max_iterations = 20}, {windows}, starts);
  constexpr int kCount = sizeof(kHorizons) / sizeof(kHorizons[0]);
  std::vector<std::vector<Sums>> parts(starts.size(),
                                       std::vector<Sums>(kCount));
  const auto predict = [&](int i) {
    const auto [r, k] = starts[i];
    const RunData& data = *problem.runs()[r];
    const Solution::Nodes& nodes = windows.runs[r];
    const std::vector<double>& t = data.run.t;
    const int first = nodes.samples[k];
    const auto end =
        std::upper_bound(t.begin(), t.end(), t[first] + reach[i] * 1.01);
    const int last = static_cast<int>(end - t.begin()) - 1;
    if (last <= first) return true;
    const SegmentRollout rollout(&problem.model(), &problem.map(),
                                 &data.measurements, first, last,
                                 solution.rollout);
    std::vector<double> r_si(rollout.num_residuals());
    std::vector<double> x_end(problem.model().state_size());
    if (!rollout(nodes.states.row(k).data(), theta.data(), r_si.data(),
                 x_end.data())) {
      return true;
    }
    for (const SegmentRow& row : rollout.rows()) {
      if (!IsPositionLike(data.run.channels[row.channel].kind)) continue;
      const double ahead = t[row.sample] - t[first];
      for (int h = 0; h < kCount; ++h) {
        // Samples within a tenth of the horizon before it.
        if (ahead > kHorizons[h] * (1 + 1e-9) || ahead < 0.9 * kHorizons[h]) {
          continue;
        }
        Sums& sum = parts[i][h];
        for (int c = 0; c < row.size; ++c) {
          sum.squares += r_si[row.first + c] * r_si[row.first + c];
        }
        sum.dof += ResidualDof(data.measurements.residuals[row.channel]);
      }
    }
    return true;
  };
  ParallelFor(static_cast<int>(starts.size()), problem.options().threads,
              predict);
  std::vector<Sums> sums(kCount);
  for (const std::vector<Sums>& part : parts) {
    for (int h = 0; h < kCount; ++h) sums[h] += part[h];
  }
  std::vector<HorizonError> result;
  for (int h = 0; h < kCount; ++h) {
    if (sums[h].dof == 0) continue;
    result.push_back({kHorizons[h], std::sqrt(sums[h].squares / sums[h].dof)});
  }
  return result;
}

std::vector<OpenError> EvaluateOpen(const ShootingProblem& problem,
                                    const Solution& point) {
  std::vector<OpenError> result;
  for (size_t r = 0; r < point.runs.size(); ++r) {
    const RunData& data = *problem.runs()[r];
    const SegmentRollout rollout(&problem.model(), &problem.map(),
                                 &data.measurements, 0, data.run.size() - 1,
                                 point.rollout);
    std::vector<double> errors(rollout.num_residuals());
    std::vector<double> x_end(problem.model().state_size());
    const bool ok = rollout(point.runs[r].states.row(0).data(),
                            point.theta.data(), errors.data(), x_end.data());
    OpenError open;
    open.trajectory = data.run.name;
    open.duration_s = data.run.t.back() - data.run.t.front();
    std::vector<double> squares(data.run.channels.size(), 0.0);
    std::vector<double> count(data.run.channels.size(), 0.0);
    for (const SegmentRow& row : rollout.rows()) {
      double norm2 = 0.0;
      for (int i = 0; i < row.size; ++i) {
        norm2 += errors[row.first + i] * errors[row.first + i];
      }
      const ChannelResidual& residual =
          data.measurements.residuals[row.channel];
      if (std::holds_alternative<PlanarHeadingResidual>(residual) ||
          std::holds_alternative<HeadingResidual>(residual)) {
        // Unit vectors at the angle e are 2 sin(e/2) apart.
        const double angle =
            2.0 * std::asin(std::min(1.0, 0.5 * std::sqrt(norm2)));
        norm2 = angle * angle;
      }
      squares[row.channel] += norm2;
      count[row.channel] += 1.0;
    }
    for (size_t c = 0; c < data.run.channels.size(); ++c) {
      if (count[c] == 0) continue;
      const Channel& channel = data.run.channels[c];
      open.channels.push_back(
          {channel.name, ResidualUnit(problem.model().mechanism(), channel),
           ok ? std::sqrt(squares[c] / count[c]) : kInfinity});
    }
    result.push_back(std::move(open));
  }
  return result;
}

std::vector<RowMatrixXd> PredictChannels(const ShootingProblem& problem,
                                         const Eigen::VectorXd& theta, int run,
                                         const RowMatrixXd& states) {
  const Model& model = problem.model();
  const StateLayout& at = model.layout();
  const Run& recording = problem.runs()[run]->run;
  MechanismParameters<double> values;
  problem.map().Apply<double>(theta.data(), &values);
  Workspace<double> ws(model);
  ws.SetParameters(values);
  std::vector<RowMatrixXd> predicted;
  for (const Channel& channel : recording.channels) {
    predicted.emplace_back(recording.size(), channel.values.cols());
  }
  for (int k = 0; k < recording.size(); ++k) {
    const double* x = states.row(k).data();
    const double* q = x + at.q();
    std::vector<double> seen(q, q + at.nq());
    for (const auto& effect : ws.measurement_effects) {
      effect.hooks->ModifyMeasurement(
          effect.p, &seen[model.bodies()[effect.body].q_index]);
    }
    ForwardKinematics<double>(&ws, q);
    for (size_t c = 0; c < recording.channels.size(); ++c) {
      const Channel& channel = recording.channels[c];
      const int columns = static_cast<int>(channel.values.cols());
      if (channel.kind == ChannelKind::kFramePosition) {
        predicted[c].row(k) =
            LinkPosition<double>(ws, channel.target).transpose();
        continue;
      }
      const Joint& joint = model.mechanism().joints[channel.target];
      const double* from = IsPositionLike(channel.kind)
                               ? seen.data() + joint.q_index
                               : x + at.qd(joint);
      predicted[c].row(k) = Eigen::Map<const Eigen::RowVectorXd>(from, columns);
    }
  }
  return predicted;
}

}  // namespace sysid
