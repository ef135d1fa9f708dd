#include "sysid/inverse_dynamics/motion.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "models/math/rotation.h"

namespace sysid {
namespace {

constexpr int kCoefficients = 6;  // of a quintic
constexpr int kEachSide = 3;      // samples that a fit needs

// Of even samples with the weights w = diag(w_k), P their powers, A = P^T w P:
// sum(w) - kTaken is what E[sum w left^2] is of the noise's variance, kTaken =
// tr(A^-1 P^T w^2 P), and kSlope = sum(w) [A^-1 P^T w^2 P A^-1]_11.
constexpr double kTaken = 2.505, kSlope = 5.854;

// The polynomials c of n components that fit values at times around; component
// k of the i-th derivative is c(i, k) i! / width^i.
template <int kComponents>
class LocalQuintic {
 public:
  void Add(double distance, const Eigen::Vector<double, kComponents>& value) {
    Eigen::Vector<double, kCoefficients> powers;
    powers[0] = 1.0;
    for (int i = 1; i < kCoefficients; ++i)
      powers[i] = distance * powers[i - 1];
    const Eigen::Vector<double, kCoefficients> weighed =
        GaussianWeight(distance) * powers;
    A_.noalias() += weighed * powers.transpose();
    b_.noalias() += weighed * value.transpose();
    squares_ += weighed[0] * value.squaredNorm();
    (distance < 0 ? before_ : after_) += 1;
  }
  bool Solve() {
    if (before_ < kEachSide || after_ < kEachSide) return false;
    c_ = A_.ldlt().solve(b_);
    return c_.allFinite();
  }
  Eigen::Vector<double, kComponents> Derivative(int i, double width) const {
    return c_.row(i).transpose() * (std::tgamma(i + 1.0) / std::pow(width, i));
  }
  // Of the first derivative, by what is left:
  //   s^2 kSlope / (sum(w) width^2),
  //   s^2 = sum w left^2 / (sum(w) - kTaken).                         (11.12)
  double SlopeVariance(double width) const {
    const double left = squares_ - c_.cwiseProduct(b_).sum();
    const double weight = A_(0, 0);
    if (!(weight > kTaken)) return 0.0;
    return std::max(0.0, left) / (weight - kTaken) * kSlope /
           (weight * width * width);
  }

 private:
  Eigen::Matrix<double, kCoefficients, kCoefficients> A_ =
      Eigen::Matrix<double, kCoefficients, kCoefficients>::Zero();
  using Columns = Eigen::Matrix<double, kCoefficients, kComponents>;
  Columns b_ = Columns::Zero(), c_;
  double squares_ = 0.0;
  int before_ = 0, after_ = 0;
};

// The samples within reach of a time: [first, last).
struct Around {
  int first, last;
};

Around SamplesAround(const std::vector<double>& t, double time, double width) {
  const auto first =
      std::lower_bound(t.begin(), t.end(), time - kGaussianReach * width);
  const auto last =
      std::upper_bound(first, t.end(), time + kGaussianReach * width);
  return {static_cast<int>(first - t.begin()),
          static_cast<int>(last - t.begin())};
}

bool SmoothScalar(const Run& run, const Channel& channel, const Around& around,
                  double time, double width, double* q, double* qd, double* qdd,
                  double* qd_variance) {
  LocalQuintic<1> fit;
  double origin = NAN;  // near the values: their squares would hide the noise
  for (int k = around.first; k < around.last; ++k) {
    const double value = channel.values(k, 0);
    if (std::isnan(value)) continue;
    if (std::isnan(origin)) origin = value;
    fit.Add((run.t[k] - time) / width,
            Eigen::Vector<double, 1>(value - origin));
  }
  if (!fit.Solve()) return false;
  *q = origin + fit.Derivative(0, width)[0];
  *qd = fit.Derivative(1, width)[0];
  *qdd = fit.Derivative(2, width)[0];
  *qd_variance = fit.SlopeVariance(width);
  return true;
}

Eigen::Quaterniond QuaternionOf(const Channel& channel, int k) {
  return Eigen::Quaterniond(channel.values(k, 3), channel.values(k, 0),
                            channel.values(k, 1), channel.values(k, 2))
      .normalized();
}

bool SmoothOrientation(const Run& run, const Channel& channel,
                       const Around& around, double time, double width,
                       double* q, double* qd, double* qdd) {
  int nearest = -1;
  for (int k = around.first; k < around.last; ++k) {
    if (std::isnan(channel.values(k, 0))) continue;
    if (nearest < 0 ||
        std::abs(run.t[k] - time) < std::abs(run.t[nearest] - time)) {
      nearest = k;
    }
  }
  if (nearest < 0) return false;
  const Eigen::Quaterniond middle = QuaternionOf(channel, nearest);
  LocalQuintic<3> fit;
  for (int k = around.first; k < around.last; ++k) {
    if (std::isnan(channel.values(k, 0))) continue;
    const Eigen::Quaterniond turned =
        middle.conjugate() * QuaternionOf(channel, k);
    fit.Add((run.t[k] - time) / width, Log<double>(turned));
  }
  if (!fit.Solve()) return false;
  const Eigen::Quaterniond at = middle * Exp<double>(fit.Derivative(0, width));
  Eigen::Map<Eigen::Vector4d>(q, 4) = at.coeffs();
  Eigen::Map<Eigen::Vector3d>(qd, 3) = fit.Derivative(1, width);
  Eigen::Map<Eigen::Vector3d>(qdd, 3) = fit.Derivative(2, width);
  return true;
}

}  // namespace

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
  sample.q.resize(model.nq());
  sample.qd.resize(model.nv());
  sample.qdd.resize(model.nv());
  sample.qd_variance.setZero(model.nv());
  const Around around = SamplesAround(run.t, time, width);
  for (const Channel& channel : run.channels) {
    const bool turns = channel.kind == ChannelKind::kOrientation;
    if (!turns && channel.kind != ChannelKind::kPosition) continue;
    const Joint& joint = model.mechanism().joints[channel.target];
    double* q = &sample.q[joint.q_index];
    double* qd = &sample.qd[joint.v_index];
    double* qdd = &sample.qdd[joint.v_index];
    const bool known =
        turns ? SmoothOrientation(run, channel, around, time, width, q, qd, qdd)
              : SmoothScalar(run, channel, around, time, width, q, qd, qdd,
                             &sample.qd_variance[joint.v_index]);
    if (!known) return sample;
  }
  sample.known = true;
  return sample;
}

}  // namespace sysid
