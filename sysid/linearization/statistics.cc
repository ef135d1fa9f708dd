#include "sysid/linearization/statistics.h"

#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

#include "models/math/decompositions.h"

namespace sysid {

double FisherTail(double f, double d1, double d2) {
  if (!(f > 0)) return 1.0;
  if (!std::isfinite(f)) return 0.0;
  const boost::math::fisher_f distribution(d1, d2);
  return boost::math::cdf(boost::math::complement(distribution, f));
}

double FisherQuantile(double p, double d1, double d2) {
  return boost::math::quantile(
      boost::math::complement(boost::math::fisher_f(d1, d2), p));
}

double NormalQuantile(double p) {
  return boost::math::quantile(
      boost::math::complement(boost::math::normal(), p));
}

double Deviations(int compared) {
  return std::max(1.0, std::sqrt(2.0 * std::log(2.0 * compared)));
}

BlockScores::BlockScores(size_t segments, int columns) {
  constexpr int kFewestBlocks = 20;
  const int count = static_cast<int>(segments);
  blocks_ = (kFewestBlocks + count - 1) / count;
  scores_.setZero(blocks_ * count, columns);
}

void BlockScores::Add(const Eigen::MatrixXd& A, const Eigen::VectorXd& e) {
  squares_ += e.squaredNorm();
  const int rows = static_cast<int>(e.size());
  for (int g = 0; g < blocks_; ++g) {
    const int begin = rows * g / blocks_;
    const int size = rows * (g + 1) / blocks_ - begin;
    scores_.row(next_++) =
        (A.middleRows(begin, size).transpose() * e.segment(begin, size))
            .transpose();
  }
}

WaldTest TestWeights(const Eigen::MatrixXd& C, const Eigen::VectorXd& alpha,
                     const Eigen::MatrixXd& scores, double squares,
                     double dof) {
  const int k = static_cast<int>(alpha.size());
  const int G = static_cast<int>(scores.rows());
  WaldTest test;
  const Eigen::MatrixXd inverse =
      SolveSymmetric(C, Eigen::MatrixXd(Eigen::MatrixXd::Identity(k, k)));
  const double variance = squares / dof;
  test.covariance = variance * inverse;
  const double white = alpha.dot(C * alpha) / variance / k;
  test.p_value = FisherTail(white, k, dof);
  if (G <= k + 1) return test;
  const Eigen::MatrixXd clustered =
      inverse * (scores.transpose() * scores) * inverse * (G / (G - 1.0));
  // Hotelling: T^2 (G - k) / (k (G - 1)) is F(k, G - k).
  const double wald =
      alpha.dot(SolveSymmetric(clustered, alpha)) * (G - k) / (k * (G - 1.0));
  test.p_value = std::max(test.p_value, FisherTail(wald, k, G - k));
  if (clustered.trace() > test.covariance.trace()) test.covariance = clustered;
  return test;
}

double StudentQuantile(double probability, double nu) {
  namespace policies = boost::math::policies;
  using Policy =
      policies::policy<policies::overflow_error<policies::ignore_error>>;
  return boost::math::quantile(
      boost::math::students_t_distribution<double, Policy>(nu), probability);
}

Heterogeneity HeterogeneityOf(const Eigen::VectorXd& values,
                              const Eigen::VectorXd& std_errors) {
  const Eigen::ArrayXd w = std_errors.array().square().inverse();
  Heterogeneity of;
  of.weights = w.sum();
  const double mean = (w * values.array()).sum() / of.weights;
  of.C = of.weights - w.square().sum() / of.weights;
  of.Q = (w * (values.array() - mean).square()).sum();
  return of;
}

double NoiseFloor(double dof) { return 1.1 + 3.0 * std::sqrt(0.5 / dof); }

}  // namespace sysid
