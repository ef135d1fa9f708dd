#include "sysid/stochastic/transformation.h"

#include <algorithm>

namespace sysid {

Transformation::Transformation(const ShootingProblem& problem) {
  constexpr double kAtBound = 1e-3;  // of a typical size
  const Eigen::VectorXd theta = problem.InitialTheta();
  start_.resize(theta.size());
  for (int i = 0; i < theta.size(); ++i) {
    const FreeParameter& free = problem.free()[i];
    Bound b;
    b.start = theta[i];
    start_[i] = free.initial;
    if (problem.map().IsTransformed(i)) {  // (4.1) keeps it possible
      bounds_.push_back(b);
      continue;
    }
    b.lower = free.lower;
    b.upper = free.upper;
    b.has_lower = std::isfinite(free.lower);
    b.has_upper = std::isfinite(free.upper);
    const double typical = free.parameter.typical_scale;
    const double inside =
        b.has_lower && b.has_upper
            ? std::min(typical, 0.25 * (free.upper - free.lower))
            : typical;
    if (b.has_lower && b.start - b.lower < kAtBound * inside) {
      b.start = b.lower + inside;
      moved_.push_back(i);
    } else if (b.has_upper && b.upper - b.start < kAtBound * inside) {
      b.start = b.upper - inside;
      moved_.push_back(i);
    }
    start_[i] = b.start;
    b.scale = std::max(std::abs(b.start), typical);
    double slope = 1.0;  // d theta / du
    if (b.has_lower && b.has_upper) {
      const double low = b.start - b.lower, high = b.upper - b.start;
      b.offset = std::log(low / high);
      slope = low * high / (low + high);
    } else if (b.has_lower) {
      slope = b.start - b.lower;
    } else if (b.has_upper) {
      slope = b.upper - b.start;
    }
    b.s = std::min(1.0, b.scale / slope);
    bounds_.push_back(b);
  }
}

Eigen::VectorXd Transformation::Theta(const Eigen::VectorXd& v) const {
  Eigen::VectorXd theta(v.size());
  Theta<double>(v.data(), theta.data());
  return theta;
}

Eigen::VectorXd Transformation::Inverse(const Eigen::VectorXd& theta) const {
  constexpr double kFar = 1e3;
  Eigen::VectorXd v(size());
  for (int i = 0; i < size(); ++i) {
    const Bound& b = bounds_[i];
    const double low = std::max(0.0, theta[i] - b.lower);
    const double high = std::max(0.0, b.upper - theta[i]);
    if (b.has_lower && b.has_upper) {
      v[i] = (std::log(low / high) - b.offset) / b.s;
    } else if (b.has_lower) {
      v[i] = std::log(low / (b.start - b.lower)) / b.s;
    } else if (b.has_upper) {
      v[i] = -std::log(high / (b.upper - b.start)) / b.s;
    } else {
      v[i] = (theta[i] - b.start) / b.scale;
      continue;
    }
    v[i] = std::clamp(v[i], -kFar / b.s, kFar / b.s);
  }
  return v;
}

Eigen::VectorXd Transformation::Slope(const Eigen::VectorXd& v) const {
  const Eigen::VectorXd theta = Theta(v);
  Eigen::VectorXd slope(v.size());
  for (int i = 0; i < size(); ++i) {
    const Bound& b = bounds_[i];
    if (b.has_lower && b.has_upper) {
      slope[i] = b.s * (theta[i] - b.lower) * (b.upper - theta[i]) /
                 (b.upper - b.lower);
    } else if (b.has_lower) {
      slope[i] = b.s * (theta[i] - b.lower);
    } else if (b.has_upper) {
      slope[i] = b.s * (b.upper - theta[i]);
    } else {
      slope[i] = b.scale;
    }
  }
  return slope;
}

}  // namespace sysid
