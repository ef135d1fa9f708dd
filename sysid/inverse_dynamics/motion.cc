#include "sysid/inverse_dynamics/motion.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "models/math/rotation.h"

namespace sysid {
namespace {

constexpr int kCoefficients = 6;  // of a quintic
constexpr int kEachSide = 3;      // samples that a fit needs

// Of even samples with the weights w = diag(w_k), P their powers, A = P^T w P:
// sum(w) - kTaken is what E[sum w left^2] is of the noise's variance, kTaken =
// tr(A^-1 P^T w^2 P), and kSlope = sum(w) [A^-1 P^T w^2 P A^-1]_11.
constexpr double kTaken = 2.505, kSlope = 5.854;

// The polynomials that fit values at samples around a time, w their Gaussian
// weights. What they share, A of (P^T w P) c = P^T w y, is there once for all
// channels that were measured at these samples.
class LocalQuintic {
 public:
  LocalQuintic(const std::vector<double>& t, std::vector<int> samples,
               double time, double width)
      : samples_(std::move(samples)),
        width_(width),
        weighed_(kCoefficients, samples_.size()) {
    int before = 0;
    Powers A = Powers::Zero();
    for (size_t i = 0; i < samples_.size(); ++i) {
      const double distance = (t[samples_[i]] - time) / width;
      Eigen::Vector<double, kCoefficients> powers;
      powers[0] = 1.0;
      for (int k = 1; k < kCoefficients; ++k) {
        powers[k] = distance * powers[k - 1];
      }
      weighed_.col(i) = GaussianWeight(distance) * powers;
      A.noalias() += weighed_.col(i) * powers.transpose();
      before += distance < 0 ? 1 : 0;
    }
    const int after = static_cast<int>(samples_.size()) - before;
    if (before < kEachSide || after < kEachSide) return;
    A_.compute(A);
    weight_ = A(0, 0);
    known_ = true;
  }
  bool known() const { return known_; }
  const std::vector<int>& samples() const { return samples_; }

  // Of values (samples x n): component k of the i-th derivative is
  // c(i, k) i! / width^i.
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& values) const {
    return A_.solve(weighed_ * values);
  }
  double Derivative(const Eigen::MatrixXd& c, int i, int k = 0) const {
    constexpr double kFactorial[] = {1.0, 1.0, 2.0};
    return c(i, k) * kFactorial[i] / std::pow(width_, i);
  }
  // Of the first derivative, by what is left of one component:
  //   s^2 kSlope / (sum(w) width^2),
  //   s^2 = sum w left^2 / (sum(w) - kTaken).                         (11.12)
  double SlopeVariance(const Eigen::MatrixXd& values,
                       const Eigen::MatrixXd& c) const {
    if (!(weight_ > kTaken)) return 0.0;
    const double left = weighed_.row(0).dot(values.col(0).cwiseAbs2()) -
                        (weighed_ * values.col(0)).dot(c.col(0));
    return std::max(0.0, left) / (weight_ - kTaken) * kSlope /
           (weight_ * width_ * width_);
  }

 private:
  using Powers = Eigen::Matrix<double, kCoefficients, kCoefficients>;
  std::vector<int> samples_;
  double width_, weight_ = 0.0;
  Eigen::Matrix<double, kCoefficients, Eigen::Dynamic> weighed_;
  Eigen::LDLT<Powers> A_;
  bool known_ = false;
};

// Samples of a channel within reach of a time.
std::vector<int> SamplesAround(const std::vector<double>& t,
                               const Channel& channel, double time,
                               double width) {
  const auto first =
      std::lower_bound(t.begin(), t.end(), time - kGaussianReach * width);
  const auto last =
      std::upper_bound(first, t.end(), time + kGaussianReach * width);
  std::vector<int> samples;
  for (auto at = first; at != last; ++at) {
    const int k = static_cast<int>(at - t.begin());
    if (!std::isnan(channel.values(k, 0))) samples.push_back(k);
  }
  return samples;
}

void SmoothScalar(const Channel& channel, const LocalQuintic& fit, double* q,
                  double* qd, double* qdd, double* qd_variance) {
  const std::vector<int>& samples = fit.samples();
  // Near the values: their squares would hide the noise.
  const double origin = channel.values(samples[0], 0);
  Eigen::VectorXd values(samples.size());
  for (size_t i = 0; i < samples.size(); ++i) {
    values[i] = channel.values(samples[i], 0) - origin;
  }
  const Eigen::MatrixXd c = fit.Solve(values);
  *q = origin + fit.Derivative(c, 0);
  *qd = fit.Derivative(c, 1);
  *qdd = fit.Derivative(c, 2);
  *qd_variance = fit.SlopeVariance(values, c);
}

Eigen::Quaterniond QuaternionOf(const Channel& channel, int k) {
  return Eigen::Quaterniond(channel.values(k, 3), channel.values(k, 0),
                            channel.values(k, 1), channel.values(k, 2))
      .normalized();
}

void SmoothOrientation(const std::vector<double>& t, double time,
                       const Channel& channel, const LocalQuintic& fit,
                       double* q, double* qd, double* qdd) {
  const std::vector<int>& samples = fit.samples();
  const int nearest =
      *std::min_element(samples.begin(), samples.end(), [&](int a, int b) {
        return std::abs(t[a] - time) < std::abs(t[b] - time);
      });
  const Eigen::Quaterniond middle = QuaternionOf(channel, nearest);
  Eigen::MatrixXd values(samples.size(), 3);
  for (size_t i = 0; i < samples.size(); ++i) {
    const Eigen::Quaterniond turned =
        middle.conjugate() * QuaternionOf(channel, samples[i]);
    values.row(i) = Log<double>(turned).transpose();
  }
  const Eigen::MatrixXd c = fit.Solve(values);
  Eigen::Vector3d turn;
  for (int k = 0; k < 3; ++k) {
    turn[k] = fit.Derivative(c, 0, k);
    qd[k] = fit.Derivative(c, 1, k);
    qdd[k] = fit.Derivative(c, 2, k);
  }
  Eigen::Map<Eigen::Vector4d>(q, 4) = (middle * Exp<double>(turn)).coeffs();
}

}  // namespace

std::vector<std::string> VelocityNames(const Model& model) {
  std::vector<std::string> names;
  for (const Body& body : model.movers()) {
    const std::string& joint = model.mechanism().joints[body.joint].name;
    for (int k = 0; k < VelocitySize(body); ++k) {
      const bool ball = body.type == JointType::kSpherical;
      names.push_back(ball ? joint + "." + "xyz"[k] : joint);
    }
  }
  return names;
}

std::vector<std::string> UnmeasuredJoints(const Model& model, const Run& run) {
  std::set<int> measured;
  for (const Channel& channel : run.channels) {
    if (channel.kind == ChannelKind::kPosition ||
        channel.kind == ChannelKind::kOrientation) {
      measured.insert(channel.target);
    }
  }
  std::vector<std::string> names;
  for (const Body& body : model.movers()) {
    if (measured.count(body.joint) == 0) {
      names.push_back(model.mechanism().joints[body.joint].name);
    }
  }
  return names;
}

MotionSample SmoothMotion(const Model& model, const Run& run, double time,
                          double width) {
  MotionSample sample;
  sample.q.setZero(model.nq());
  sample.qd.setZero(model.nv());
  sample.qdd.setZero(model.nv());
  sample.qd_variance.setZero(model.nv());
  std::optional<LocalQuintic> fit;  // of the channel before
  for (const Channel& channel : run.channels) {
    const bool turns = channel.kind == ChannelKind::kOrientation;
    if (!turns && channel.kind != ChannelKind::kPosition) continue;
    std::vector<int> samples = SamplesAround(run.t, channel, time, width);
    if (!fit || fit->samples() != samples) {
      fit.emplace(run.t, std::move(samples), time, width);
    }
    if (!fit->known()) return sample;
    const Joint& joint = model.mechanism().joints[channel.target];
    double* q = &sample.q[joint.q_index];
    double* qd = &sample.qd[joint.v_index];
    double* qdd = &sample.qdd[joint.v_index];
    if (turns) {
      SmoothOrientation(run.t, time, channel, *fit, q, qd, qdd);
    } else {
      SmoothScalar(channel, *fit, q, qd, qdd,
                   &sample.qd_variance[joint.v_index]);
    }
    if (!sample.q.allFinite() || !sample.qdd.allFinite()) return sample;
  }
  sample.known = true;
  return sample;
}

}  // namespace sysid
