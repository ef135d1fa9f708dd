#include "sysid/fleet/random_effects.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

#include "glog/logging.h"
#include "models/math/constants.h"
#include "sysid/linearization/statistics.h"

namespace sysid {
namespace {

constexpr double kUpper = 0.975;  // of a two-sided 95 % interval

double ChiSquareTail(double q, double dof) {
  if (!(q > 0)) return 1.0;
  if (!std::isfinite(q)) return 0.0;
  return boost::math::cdf(
      boost::math::complement(boost::math::chi_squared(dof), q));
}

std::array<double, 2> Around(double middle, double half_width) {
  return {middle - half_width, middle + half_width};
}

// y and s of all, each over the smallest s and from the median: squares of
// weights of any size stay in range, differences of large values exact.
struct Scaled {
  Eigen::ArrayXd y, s;
  double unit = 1.0, origin = 0.0;

  explicit Scaled(const std::vector<RobotEstimate>& estimates)
      : y(estimates.size()), s(estimates.size()) {
    std::vector<double> values;
    unit = std::numeric_limits<double>::infinity();
    for (const RobotEstimate& estimate : estimates) {
      CHECK_GT(estimate.std_error, 0.0);
      unit = std::min(unit, estimate.std_error);
      values.push_back(estimate.value);
    }
    std::nth_element(values.begin(), values.begin() + values.size() / 2,
                     values.end());
    origin = values[values.size() / 2];
    for (size_t i = 0; i < estimates.size(); ++i) {
      y[i] = (estimates[i].value - origin) / unit;
      s[i] = estimates[i].std_error / unit;
    }
  }
};

}  // namespace

double StudentTails(double x, double nu) {
  if (std::isnan(x)) return 1.0;
  if (std::isinf(x)) return 0.0;
  return 2.0 * boost::math::cdf(boost::math::students_t(nu), -std::abs(x));
}

RandomEffects PoolEstimates(const std::vector<RobotEstimate>& estimates) {
  CHECK(!estimates.empty());
  const Scaled scaled(estimates);
  const Eigen::ArrayXd& y = scaled.y;
  const Eigen::ArrayXd variance = scaled.s.square();
  const int k = static_cast<int>(y.size());
  RandomEffects pooled;
  pooled.count = k;
  const Eigen::ArrayXd w = variance.inverse();
  const double s1 = w.sum(), s2 = w.square().sum();
  const double m = (w * y).sum() / s1;
  const double q = (w * (y - m).square()).sum();  // (F.3)
  const double c = s1 - s2 / s1;                  // (F.4)
  const double excess = std::max(0.0, q - (k - 1));
  const double tau2 = k > 1 && c > 0.0 ? excess / c : 0.0;  // (F.5)
  const Eigen::ArrayXd v = (variance + tau2).inverse();
  const double mu = (v * y).sum() / v.sum();  // (F.7)
  const double h =
      k > 1 ? (v * (y - mu).square()).sum() / (k - 1) : 0.0;  // (F.8)
  const double se = std::sqrt(std::max(1.0, h) / v.sum());    // (F.9)
  // (F.11): of Q = y' A y with A = W - w w' / S_1, as it is spread by tau2.
  const Eigen::ArrayXd sigma = variance + tau2;
  const double b1 = (w.square() * sigma).sum();
  const double b2 = (w * sigma).square().sum();
  const double b3 = (w.cube() * sigma.square()).sum();
  const double q_variance = 2.0 * (b2 - 2.0 * b3 / s1 + b1 * b1 / (s1 * s1));
  const double unit2 = scaled.unit * scaled.unit;
  pooled.q = q;
  pooled.i2 = excess > 0.0 ? excess / q : 0.0;  // (F.6)
  pooled.tau2 = tau2 * unit2;
  pooled.tau2_variance =
      k > 1 && c > 0.0 ? q_variance / (c * c) * unit2 * unit2 : kNaN;
  pooled.mean = scaled.origin + mu * scaled.unit;
  pooled.std_error = se * scaled.unit;
  return pooled;
}

std::array<double, 2> RandomEffects::Ci95() const {
  if (count < 2) return Around(mean, kNaN);
  return Around(mean,
                StudentQuantile(kUpper, count - 1) * std_error);  // (F.10)
}

std::array<double, 2> RandomEffects::Predicted95() const {
  if (count < 3) return Around(mean, kNaN);
  const double v = tau2 + std_error * std_error;
  const double t = StudentQuantile(kUpper, DegreesOfFreedom(v));
  // Of a few hundredths of a degree of freedom it overflows.
  constexpr double kNothing = 1e3;  // a range so wide says nothing
  return Around(mean, t < kNothing ? t * std::sqrt(v) : kNaN);  // (F.13)
}

double RandomEffects::QPValue() const {
  return count > 1 ? ChiSquareTail(q, count - 1) : 1.0;
}

double RandomEffects::DegreesOfFreedom(double v) const {
  // v^2 / Var(tau2): with neither below or above what a double holds.
  const double ratio = v / std::sqrt(tau2_variance);
  return std::min(count - 1.0, 2.0 * ratio * ratio);  // (F.12)
}

Drift RegressOnDates(const std::vector<RobotEstimate>& estimates,
                     const std::vector<double>& dates) {
  CHECK_EQ(estimates.size(), dates.size());
  CHECK_GE(estimates.size(), 4u);
  const Scaled scaled(estimates);
  const Eigen::VectorXd y = scaled.y.matrix();
  const Eigen::ArrayXd variance = scaled.s.square();
  const int k = static_cast<int>(y.size());
  Drift drift;
  drift.count = k;
  const Eigen::Map<const Eigen::VectorXd> t(dates.data(), k);
  drift.mean_date = t.mean();
  const Eigen::VectorXd from_mean = t.array() - drift.mean_date;
  const double span = from_mean.cwiseAbs().maxCoeff();
  CHECK_GT(span, 0.0);
  Eigen::MatrixXd X(k, 2);
  X << Eigen::VectorXd::Ones(k), from_mean / span;
  const auto solve = [&](const Eigen::ArrayXd& weights, double* squares,
                         Eigen::Matrix2d* inverse) {
    const Eigen::MatrixXd weighted = weights.matrix().asDiagonal() * X;
    *inverse = Eigen::Matrix2d(X.transpose() * weighted).inverse();
    const Eigen::Vector2d ab = *inverse * (weighted.transpose() * y);
    *squares = (weights * (y - X * ab).array().square()).sum();
    return ab;
  };
  double q = 0.0, squares = 0.0;
  Eigen::Matrix2d inverse;
  const Eigen::ArrayXd w = variance.inverse();
  solve(w, &q, &inverse);
  const Eigen::MatrixXd w2x = w.square().matrix().asDiagonal() * X;
  const double c = w.sum() - (inverse * (X.transpose() * w2x)).trace();
  const double tau2 = c > 0.0 ? std::max(0.0, q - (k - 2)) / c : 0.0;  // (F.17)
  const Eigen::Vector2d ab =
      solve((variance + tau2).inverse(), &squares, &inverse);  // (F.18)
  const double h = std::max(1.0, squares / (k - 2));
  const double se = std::sqrt(h * inverse(1, 1));
  const double unit = scaled.unit;
  drift.tau2 = tau2 * unit * unit;
  drift.intercept = scaled.origin + ab[0] * unit;
  drift.slope = ab[1] * unit / span;
  drift.std_error = se * unit / span;
  drift.ci95 =
      Around(drift.slope, StudentQuantile(kUpper, k - 2) * drift.std_error);
  drift.p_value = StudentTails(ab[1] / se, k - 2);
  return drift;
}

}  // namespace sysid
