#include "sysid/inverse_dynamics/motion.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "models/math/rotation.h"
#include "models/state.h"

namespace sysid {
namespace {

constexpr int kCoefficients = 6;  // of a quintic
constexpr int kEachSide = 3;      // samples that a fit needs

// Of even samples with the weights w = diag(w_k), P their powers, A = P^T w P:
// sum(w) - kTaken is what E[sum w left^2] is of the noise's variance, kTaken =
// tr(A^-1 P^T w^2 P), and kSlope = sum(w) [A^-1 P^T w^2 P A^-1]_11.
constexpr double kTaken = 2.505, kSlope = 5.854;

}  // namespace

// The polynomials that fit values at samples around a time, w their Gaussian
// weights:
//
//   (P^T w P) c = P^T w y.
//
// The matrix (P^T w P)^-1 P^T w is there once for all channels that were
// measured at these samples, and for all times around which they lie alike.
class MotionSmoother::LocalQuintic {
 public:
  explicit LocalQuintic(double width) : width_(width) {}

  // The samples of a channel around a time.
  void MoveTo(const std::vector<double>& t, const Channel& channel,
              double time);
  bool known() const { return known_; }
  const std::vector<int>& samples() const { return samples_; }

  // Of values (samples x n): component k of the i-th derivative is
  // c(i, k) i! / width^i.
  template <typename Values>
  Eigen::Matrix<double, kCoefficients, Values::ColsAtCompileTime> Solve(
      const Values& values) const {
    return solve_ * values;
  }
  template <typename Coefficients>
  double Derivative(const Coefficients& c, int i, int k = 0) const {
    return i == 0   ? c(0, k)
           : i == 1 ? c(1, k) / width_
                    : 2.0 * c(2, k) / (width_ * width_);
  }
  // Of the first derivative, by what is left of one component:
  //   s^2 kSlope / (sum(w) width^2),
  //   s^2 = sum w left^2 / (sum(w) - kTaken).                         (11.12)
  double SlopeVariance(const Eigen::VectorXd& values,
                       const Eigen::Vector<double, kCoefficients>& c) const {
    const double weight = weighted_.row(0).sum();
    if (!(weight > kTaken)) return 0.0;
    const double left =
        weighted_.row(0).dot(values.cwiseAbs2()) - c.dot(weighted_ * values);
    return std::max(0.0, left) / (weight - kTaken) * kSlope /
           (weight * width_ * width_);
  }

 private:
  using Powers = Eigen::Matrix<double, kCoefficients, kCoefficients>;
  void Factor();

  const double width_;
  std::vector<int> samples_;
  std::vector<double> distances_, before_;  // widths; of the fit before
  Eigen::Matrix<double, kCoefficients, Eigen::Dynamic> weighted_, solve_;
  bool known_ = false;
};

void MotionSmoother::LocalQuintic::MoveTo(const std::vector<double>& t,
                                          const Channel& channel, double time) {
  // Of a width: rounding of times.
  constexpr double kAlike = 1e-9;
  const auto first =
      std::lower_bound(t.begin(), t.end(), time - kGaussianReach * width_);
  distances_.swap(before_);
  distances_.clear();
  samples_.clear();
  bool alike = true;
  for (auto at = first; at != t.end() && *at <= time + kGaussianReach * width_;
       ++at) {
    const int k = static_cast<int>(at - t.begin());
    if (std::isnan(channel.values(k, 0))) continue;
    const double distance = (*at - time) / width_;
    const size_t i = samples_.size();
    alike =
        alike && i < before_.size() && std::abs(distance - before_[i]) < kAlike;
    samples_.push_back(k);
    distances_.push_back(distance);
  }
  if (alike && samples_.size() == before_.size()) return;
  Factor();
}

void MotionSmoother::LocalQuintic::Factor() {
  const int n = static_cast<int>(distances_.size());
  const auto after =
      std::count_if(distances_.begin(), distances_.end(),
                    [](double distance) { return distance >= 0.0; });
  known_ = n - after >= kEachSide && after >= kEachSide;
  if (!known_) return;
  weighted_.resize(kCoefficients, n);
  Powers A = Powers::Zero();
  for (int i = 0; i < n; ++i) {
    Eigen::Vector<double, kCoefficients> powers;
    powers[0] = 1.0;
    for (int k = 1; k < kCoefficients; ++k) {
      powers[k] = distances_[i] * powers[k - 1];
    }
    weighted_.col(i) = GaussianWeight(distances_[i]) * powers;
    A.noalias() += weighted_.col(i) * powers.transpose();
  }
  solve_ = A.ldlt().solve(weighted_);
}

namespace {

template <typename Fit>
void SmoothScalar(const Channel& channel, const Fit& fit, double* q, double* qd,
                  double* qdd, double* qd_variance) {
  const std::vector<int>& samples = fit.samples();
  // Near the values: their squares would hide the noise.
  const double origin = channel.values(samples[0], 0);
  Eigen::VectorXd values(samples.size());
  for (size_t i = 0; i < samples.size(); ++i) {
    values[i] = channel.values(samples[i], 0) - origin;
  }
  const auto c = fit.Solve(values);
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

template <typename Fit>
void SmoothOrientation(const std::vector<double>& t, double time,
                       const Channel& channel, const Fit& fit, double* q,
                       double* qd, double* qdd) {
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
  const auto c = fit.Solve(values);
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

MotionSmoother::MotionSmoother(const Model& model, const Run& run, double width)
    : model_(model),
      run_(run),
      width_(width),
      fit_(std::make_unique<LocalQuintic>(width)) {}

MotionSmoother::~MotionSmoother() = default;

MotionSample MotionSmoother::At(double time) {
  MotionSample sample;
  sample.q.setZero(model_.nq());
  sample.qd.setZero(model_.nv());
  sample.qdd.setZero(model_.nv());
  sample.qd_variance.setZero(model_.nv());
  for (const Channel& channel : run_.channels) {
    const bool turns = channel.kind == ChannelKind::kOrientation;
    if (!turns && channel.kind != ChannelKind::kPosition) continue;
    fit_->MoveTo(run_.t, channel, time);
    if (!fit_->known()) return sample;
    const Joint& joint = model_.mechanism().joints[channel.target];
    double* q = &sample.q[joint.q_index];
    double* qd = &sample.qd[joint.v_index];
    double* qdd = &sample.qdd[joint.v_index];
    if (turns) {
      SmoothOrientation(run_.t, time, channel, *fit_, q, qd, qdd);
    } else {
      SmoothScalar(channel, *fit_, q, qd, qdd,
                   &sample.qd_variance[joint.v_index]);
    }
  }
  sample.known = sample.q.allFinite() && sample.qdd.allFinite();
  return sample;
}

MotionSample SmoothMotion(const Model& model, const Run& run, double time,
                          double width) {
  return MotionSmoother(model, run, width).At(time);
}

Eigen::VectorXd SmoothState(const Model& model, const Run& run, int sample,
                            double width) {
  const bool later = 2 * sample < run.size();
  int known = sample;
  MotionSample motion = SmoothMotion(model, run, run.t[known], width);
  while (!motion.known && (later ? known + 1 < run.size() : known > 0)) {
    known += later ? 1 : -1;
    motion = SmoothMotion(model, run, run.t[known], width);
  }
  if (!motion.known) return NeutralState(model);
  const double s = run.t[sample] - run.t[known];
  const StateLayout& at = model.layout();
  Eigen::VectorXd x(at.size()), dx(at.tangent_size());
  x << motion.q, motion.qd;
  dx << motion.qd * s + 0.5 * s * s * motion.qdd, motion.qdd * s;
  BoxPlus<double>(model, x.data(), dx.data(), x.data());
  return x;
}

}  // namespace sysid
