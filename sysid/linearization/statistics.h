#pragma once

#include <vector>

#include "models/math/types.h"

namespace sysid {

// Tails of the distributions that the tests of a diagnosis need.

// P(F > f) with d1 and d2 degrees of freedom (d2 may be large).
double FisherTail(double f, double d1, double d2);
// The f with P(F > f) = p.
double FisherQuantile(double p, double d1, double d2);
// The x that a standard normal variable exceeds with probability p.
double NormalQuantile(double p);

// What chance makes of the best of `compared` models, each by two tests: the
// largest of as many standard normal deviates, about sqrt(2 ln (2 compared)).
// For comparisons that nothing else guards.
double Deviations(int compared);

// What weights leave, segment by segment: A' e of each of a few blocks of time,
// and |e|^2. So many blocks a segment that there are 20 at least, for clusters.
class BlockScores {
 public:
  BlockScores(size_t segments, int columns);
  // The next segment's.
  void Add(const Eigen::MatrixXd& A, const Eigen::VectorXd& e);
  const Eigen::MatrixXd& scores() const { return scores_; }
  double squares() const { return squares_; }

 private:
  int blocks_, next_ = 0;   // of a segment; of all
  Eigen::MatrixXd scores_;  // blocks x columns
  double squares_ = 0.0;
};

// Of Student's distribution with nu degrees of freedom.
double StudentQuantile(double probability, double nu);

// How much estimates of one number differ beyond their standard errors
// (DerSimonian and Laird 1986): Cochran's Q of n of them is about n - 1 where
// they do not, and tau^2 = (Q - (n - 1)) / C is the variance of what they
// estimate.
struct Heterogeneity {
  double Q = 0.0, C = 0.0;
  double weights = 0.0;  // sum of 1 / std_error^2
};
Heterogeneity HeterogeneityOf(const Eigen::VectorXd& values,
                              const Eigen::VectorXd& std_errors);

// The largest normalised error that may still be noise, with `dof` numbers:
// three standard deviations above 1.1.
double NoiseFloor(double dof);

// The Wald test of weights alpha = -C^-1 A' r of columns A, C = A' A, against
// none, when the errors e = r + A alpha that remain are serially correlated.
// `scores` holds A' e of each block of time, blocks x columns, which sum to
// about zero. The variance of alpha is the larger of
//   s^2 C^-1, s^2 = |e|^2 / dof            (white errors), and
//   C^-1 [G / (G - 1) sum_g h_g h_g'] C^-1 (clusters: Liang and Zeger 1986)
// the second with Hotelling's distribution for the few blocks G.      (7.5)
struct WaldTest {
  double p_value = 1.0;
  Eigen::MatrixXd covariance;  // of alpha
};
WaldTest TestWeights(const Eigen::MatrixXd& C, const Eigen::VectorXd& alpha,
                     const Eigen::MatrixXd& scores, double squares, double dof);

}  // namespace sysid
