#include "sysid/linearization/residual_tests.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "models/math/decompositions.h"
#include "models/math/rotation.h"
#include "sysid/linearization/statistics.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostLags = 20;
constexpr double kOut = 3.0;     // standard errors
constexpr double kBand = 2.576;  // of a normal distribution, 99 %
constexpr double kSignificantTest = 0.01;
// Of an effort before an error, s, and how many lags are looked at.
constexpr double kEarliest = -0.1, kLatest = 0.4;
constexpr int kMostInputLags = 26;

// One independent number that a channel measures, over one segment.
struct Series {
  int run = 0, first = 0;   // sample
  std::vector<int> at;      // row of e for each sample, -1 where missing
  std::vector<int> sample;  // of each row
  VectorXd e;               // whitened errors
  // e = (1 - Q Q') n for the noise n of the whole segment: these rows of Q,
  // what fitting the state took.
  MatrixXd Q;
};

// A basis of the directions in which a channel's errors are independent: rows
// of the residual times numbers. Headings are unit vectors.
MatrixXd Directions(const ChannelResidual& residual, const Channel& channel,
                    int sample) {
  const auto measured = channel.values.row(sample);
  if (std::holds_alternative<PlanarHeadingResidual>(residual)) {
    return Eigen::Vector2d(-std::sin(measured[0]), std::cos(measured[0]));
  }
  if (const auto* heading = std::get_if<HeadingResidual>(&residual)) {
    // In the child's axes, where they do not move with the link.
    const Eigen::Vector3d across = heading->axis.unitOrthogonal();
    MatrixXd out(3, 2);
    out << across, heading->axis.cross(across);
    return ToMatrix(Eigen::Quaterniond(measured[3], measured[0], measured[1],
                                       measured[2])) *
           out;
  }
  const int size = ResidualSize(residual);
  return MatrixXd::Identity(size, size);
}

// The series of a channel, by its name, in all segments: its numbers in turn.
std::vector<Series> SeriesOf(const LinearizedFit& fit,
                             const std::string& name) {
  std::vector<Series> all;
  for (const auto& segment : fit.segments()) {
    const SegmentRollout& rollout = *segment->rollout;
    const Run& run = fit.problem().runs()[segment->run]->run;
    const VectorXd e = segment->whitened;
    std::vector<const SegmentRow*> rows;
    for (const SegmentRow& row : rollout.rows()) {
      if (run.channels[row.channel].name == name) rows.push_back(&row);
    }
    if (rows.empty()) continue;
    const auto& residuals = rollout.measurements().residuals;
    const int numbers = ResidualDof(residuals[rows[0]->channel]);
    for (int i = 0; i < numbers; ++i) {
      Series series;
      series.run = segment->run;
      series.first = rollout.first();
      series.at.assign(rollout.last() - rollout.first() + 1, -1);
      series.e.resize(rows.size());
      series.Q.resize(rows.size(), segment->basis.cols());
      for (size_t k = 0; k < rows.size(); ++k) {
        const SegmentRow& row = *rows[k];
        const VectorXd along = Directions(residuals[row.channel],
                                          run.channels[row.channel], row.sample)
                                   .col(i);
        series.at[row.sample - series.first] = static_cast<int>(k);
        series.sample.push_back(row.sample);
        series.e[k] = along.dot(e.segment(row.first, row.size));
        series.Q.row(k) =
            along.transpose() * segment->basis.middleRows(row.first, row.size);
      }
      all.push_back(std::move(series));
    }
  }
  return all;
}

std::vector<std::string> ChannelNames(const LinearizedFit& fit) {
  std::vector<std::string> names;
  for (const auto& data : fit.problem().runs()) {
    for (const Channel& channel : data->run.channels) {
      if (std::find(names.begin(), names.end(), channel.name) == names.end()) {
        names.push_back(channel.name);
      }
    }
  }
  return names;
}

// Half the sum of what stands `lag` samples before and after each row:
// c_lag = e' M_lag e.
MatrixXd Shifted(const Series& series, const MatrixXd& x, int lag, int* pairs) {
  MatrixXd out = MatrixXd::Zero(x.rows(), x.cols());
  const int samples = static_cast<int>(series.at.size());
  for (int k = 0; k + lag < samples; ++k) {
    const int a = series.at[k], b = series.at[k + lag];
    if (a < 0 || b < 0) continue;
    out.row(a) += 0.5 * x.row(b);
    out.row(b) += 0.5 * x.row(a);
    ++*pairs;
  }
  return out;
}

Whiteness TestChannel(const std::string& name, const std::vector<Series>& all,
                      double period) {
  Whiteness out;
  out.channel = name;
  double squares = 0.0, dof = 0.0, longest = 0.0;
  for (const Series& series : all) {
    squares += series.e.squaredNorm();
    dof += series.e.size() - series.Q.squaredNorm();
    out.samples += static_cast<int>(series.e.size());
    longest = std::max<double>(longest, series.e.size());
  }
  const int lags = std::min<int>(
      {kMostLags, static_cast<int>(longest / 2), out.samples / 5});
  if (lags < 1 || !(squares > 0) || !(dof > 1)) return out;
  // What the sums of products c_lag are expected to be of white noise, and
  // their covariance.                                                   (7.6)
  VectorXd c = VectorXd::Zero(lags), expected = c, count = c;
  MatrixXd V = MatrixXd::Zero(lags, lags);
  for (const Series& series : all) {
    std::vector<MatrixXd> MQ(lags), QMQ(lags);
    for (int l = 0; l < lags; ++l) {
      int pairs = 0, ignored = 0;
      c[l] += series.e.dot(Shifted(series, series.e, l + 1, &ignored).col(0));
      MQ[l] = Shifted(series, series.Q, l + 1, &pairs);
      QMQ[l] = series.Q.transpose() * MQ[l];
      expected[l] -= QMQ[l].trace();
      count[l] += pairs;
      V(l, l) += pairs;
      for (int m = 0; m <= l; ++m) {
        V(l, m) += 2.0 * QMQ[l].cwiseProduct(QMQ[m]).sum() -
                   4.0 * MQ[l].cwiseProduct(MQ[m]).sum();
      }
    }
  }
  const double variance = squares / dof;
  const VectorXd d = c / variance - expected;
  V = V.selfadjointView<Eigen::Lower>();
  int told = 0;
  while (told < lags && V(told, told) > 0.1 * count[told] && count[told] > 5) {
    ++told;
  }
  const Cholesky factor(V.topLeftCorner(told, told));
  if (told == 0 || !factor.Valid()) return out;
  out.lags = told;
  const VectorXd rho = d.cwiseQuotient(count);
  for (int l = 0; l < told; ++l) {
    const double error = std::sqrt(V(l, l)) / count[l];
    if (std::abs(rho[l]) > kOut * error) ++out.lags_out;
    out.autocorrelation.lag_s.push_back((l + 1) * period);
    out.autocorrelation.value.push_back(rho[l]);
    out.autocorrelation.band.push_back(kBand * error);
  }
  out.lag1 = rho[0];
  for (int l = 0; l < told; ++l) {
    if (rho[l] < 2.0 / std::sqrt(out.samples)) break;
    out.time += 2.0 * rho[l];
  }
  const double q = d.head(told).dot(factor.Solve(VectorXd(d.head(told))));
  out.p_value = FisherTail(q / told, told, dof);
  return out;
}

// An effort less its mean over the run; none where it is constant.
struct EffortInput {
  std::string name;
  int column;
  std::vector<VectorXd> u;  // per run
};

std::vector<EffortInput> InputsOf(const LinearizedFit& fit) {
  const Model& model = fit.problem().model();
  std::vector<EffortInput> inputs;
  for (const Body& body : model.movers()) {
    for (int c = 0; c < VelocitySize(body); ++c) {
      EffortInput input;
      input.name = model.mechanism().joints[body.joint].name;
      if (body.type == JointType::kSpherical) {
        input.name += std::string(".") + "xyz"[c];
      }
      input.column = body.v_index + c;
      double largest = 0.0, moved = 0.0;
      for (const auto& data : fit.problem().runs()) {
        const VectorXd u = data->run.effort.col(input.column);
        input.u.push_back(u.array() - u.mean());
        largest = std::max(largest, u.cwiseAbs().maxCoeff());
        moved = std::max(moved, input.u.back().cwiseAbs().maxCoeff());
      }
      if (moved > 1e-9 * largest && moved > 0) inputs.push_back(input);
    }
  }
  return inputs;
}

// How many of `lags` lags, `stride` samples apart, are independent of each
// other: neighbours of a smooth effort are not.
double IndependentLags(const EffortInput& input, int lags, int stride) {
  double squares = 0.0, time = 1.0;
  for (const VectorXd& u : input.u) squares += u.squaredNorm();
  for (int l = 1; l < lags; ++l) {
    double product = 0.0;
    for (const VectorXd& u : input.u) {
      const int left = static_cast<int>(u.size()) - l * stride;
      if (left > 0) product += u.head(left).dot(u.tail(left));
    }
    if (!(product > 0)) break;
    time += 2.0 * product / squares;
  }
  return std::max(1.0, lags / time);
}

// A correlation, its standard error, and the p-value of the Wald test (7.5).
struct Correlation {
  double value = 0.0, std_error = 0.0, p_value = 1.0;
};

// Of the errors with the effort `lag` samples before them: the weight of one
// column, the effort, as a correlation.
Correlation Correlate(const std::vector<Series>& all, const EffortInput& input,
                      int lag) {
  double product = 0.0, C = 0.0, squares = 0.0, efforts = 0.0, dof = -1.0;
  std::vector<VectorXd> shifted;
  for (const Series& series : all) {
    const VectorXd& u = input.u[series.run];
    VectorXd part(series.e.size());
    for (int k = 0; k < part.size(); ++k) {
      const int from = std::clamp<int>(series.sample[k] - lag, 0,
                                       static_cast<int>(u.size()) - 1);
      part[k] = u[from];
    }
    efforts += part.squaredNorm();
    part -= series.Q * (series.Q.transpose() * part);
    // Of both with what the states leave of the effort: with all of it, the
    // product could be more than the norms allow, and no correlation.
    product += part.dot(series.e);
    C += part.squaredNorm();
    squares += series.e.squaredNorm();
    dof += series.e.size() - series.Q.squaredNorm();
    shifted.push_back(std::move(part));
  }
  // What the states take up says nothing.
  if (!(C > 1e-9 * efforts) || !(squares > 0) || !(dof > 1)) return {};
  const double alpha = -product / C;
  BlockScores left(all.size(), 1);
  for (size_t s = 0; s < all.size(); ++s) {
    left.Add(shifted[s], all[s].e + alpha * shifted[s]);
  }
  const WaldTest test =
      TestWeights(MatrixXd::Constant(1, 1, C), VectorXd::Constant(1, alpha),
                  left.scores(), left.squares(), dof);
  return {product / std::sqrt(C * squares),
          std::sqrt(test.covariance(0, 0) * C / squares), test.p_value};
}

}  // namespace

std::vector<Whiteness> TestWhiteness(const LinearizedFit& fit) {
  std::vector<Whiteness> out;
  if (!fit.Valid()) return out;
  const double period = fit.problem().data().MedianSamplePeriod();
  for (const std::string& name : ChannelNames(fit)) {
    const std::vector<Series> all = SeriesOf(fit, name);
    if (!all.empty()) out.push_back(TestChannel(name, all, period));
  }
  return out;
}

std::vector<InputCorrelation> CorrelateInputs(const LinearizedFit& fit) {
  std::vector<InputCorrelation> out;
  if (!fit.Valid()) return out;
  const std::vector<EffortInput> inputs = InputsOf(fit);
  if (inputs.empty()) return out;
  const double period = fit.problem().data().MedianSamplePeriod();
  const int first = static_cast<int>(std::ceil(kEarliest / period));
  const int last = static_cast<int>(std::floor(kLatest / period));
  const int stride = std::max(1, (last - first) / (kMostInputLags - 1));
  const std::vector<std::string> names = ChannelNames(fit);
  for (const std::string& name : names) {
    const std::vector<Series> all = SeriesOf(fit, name);
    if (all.empty()) continue;
    for (const EffortInput& input : inputs) {
      InputCorrelation best;
      best.channel = name;
      best.input = input.name;
      int lags = 0;
      double least = 1.0;
      // Whole strides from none.
      for (int lag = first - first % stride; lag <= last; lag += stride) {
        const Correlation at = Correlate(all, input, lag);
        ++lags;
        if (std::abs(at.value) > std::abs(best.correlation)) {
          best.correlation = at.value;
          best.lag_s = lag * period;
        }
        least = std::min(least, at.p_value);
        best.over_lags.lag_s.push_back(lag * period);
        best.over_lags.value.push_back(at.value);
        best.over_lags.band.push_back(kBand * at.std_error);
      }
      best.p_value = std::min(1.0, least * names.size() * inputs.size() *
                                       IndependentLags(input, lags, stride));
      best.significant = best.p_value < kSignificantTest;
      out.push_back(best);
    }
  }
  return out;
}

}  // namespace sysid
