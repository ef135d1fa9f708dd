#pragma once

#include <cmath>
#include <vector>

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// Bounds by transformation: theta = T(v), component by component, for any v in
// R^n. v = 0 is the start theta_0, and one unit of v is about the parameter's
// own size there, so one learning rate serves a length and a friction:
//
//   no bound:     theta = theta_0 + scale v
//   lower a:      theta = a + (theta_0 - a) exp(s v)
//   upper b:      theta = b - (b - theta_0) exp(-s v)
//   both:         theta = a + (b - a) / (1 + exp(-(u_0 + s v)))        (9.2)
//
// with u_0 so that v = 0 gives theta_0, scale = max(|theta_0|, typical), and s
// so that d theta/dv = scale there, but at most 1.
class Transformation {
 public:
  // A start at (or within a thousandth of a typical size of) a bound has no
  // derivative there: it is moved inside by that size. moved(): those.
  explicit Transformation(const ShootingProblem& problem);

  int size() const { return static_cast<int>(bounds_.size()); }
  const std::vector<int>& moved() const { return moved_; }
  // The parameters' values at v = 0.
  const Eigen::VectorXd& start() const { return start_; }

  // T is double, a Jet or the tape's scalar.
  template <typename T>
  void Theta(const T* v, T* theta) const;
  Eigen::VectorXd Theta(const Eigen::VectorXd& v) const;
  // v for theta within its bounds; one at a bound, where v is infinite, a large
  // v that gives it.
  Eigen::VectorXd Inverse(const Eigen::VectorXd& theta) const;
  // d theta / dv, the diagonal.
  Eigen::VectorXd Slope(const Eigen::VectorXd& v) const;

 private:
  struct Bound {
    bool has_lower = false, has_upper = false;
    double lower = 0.0, upper = 0.0;
    double start = 0.0;   // theta_0
    double scale = 1.0;   // of theta_0
    double s = 1.0;       // of the exponent
    double offset = 0.0;  // u_0
  };

  std::vector<Bound> bounds_;
  Eigen::VectorXd start_;
  std::vector<int> moved_;
};

template <typename T>
void Transformation::Theta(const T* v, T* theta) const {
  using std::exp;
  for (int i = 0; i < size(); ++i) {
    const Bound& b = bounds_[i];
    if (b.has_lower && b.has_upper) {
      theta[i] =
          b.lower + (b.upper - b.lower) / (1.0 + exp(-(b.offset + b.s * v[i])));
    } else if (b.has_lower) {
      theta[i] = b.lower + (b.start - b.lower) * exp(b.s * v[i]);
    } else if (b.has_upper) {
      theta[i] = b.upper - (b.upper - b.start) * exp(-(b.s * v[i]));
    } else {
      theta[i] = b.start + b.scale * v[i];
    }
  }
}

}  // namespace sysid
