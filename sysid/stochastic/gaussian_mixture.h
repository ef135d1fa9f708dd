#pragma once

#include <random>

#include "sysid/stochastic/transformation.h"

namespace sysid {

// A mixture of K Gaussian kernels with diagonal deviations over v (the
// unbounded form of theta, transformation.h), n numbers.
struct GaussianMixture {
  Eigen::VectorXd logits;          // K: log weights, but for a constant
  Eigen::MatrixXd means;           // K x n
  Eigen::MatrixXd log_deviations;  // K x n

  int kernels() const { return static_cast<int>(logits.size()); }
  int dimension() const { return static_cast<int>(means.cols()); }

  Eigen::VectorXd Weights() const;  // softmax of the logits
  Eigen::MatrixXd Deviations() const;
  // Moments of the mixture, of all kernels together.
  Eigen::VectorXd Mean() const;
  Eigen::MatrixXd Covariance() const;

  // As one vector, for Adam: logits, means row by row, log deviations.
  Eigen::VectorXd Pack() const;
  void Unpack(const Eigen::VectorXd& packed);

  // A draw of the mixture itself: a kernel by its weight, then v from it.
  Eigen::VectorXd Sample(std::mt19937_64* random) const;
};

// K kernels of equal weight about v = 0, the means drawn with the deviation
// `spread`, which is also that of each kernel.
GaussianMixture StartingMixture(int kernels, int dimension, double spread,
                                std::mt19937_64* random);

// The random numbers of D reparameterised draws, a row each.
struct MixtureNoise {
  Eigen::ArrayXXd gumbel;  // D x K, standard Gumbel
  Eigen::ArrayXXd normal;  // D x K n, standard normal, kernel by kernel
};
void DrawNoise(int draws, int kernels, int dimension, std::mt19937_64* random,
               MixtureNoise* noise);

// Draws by Gumbel-Softmax at temperature tau (equation 2 of Heiden et al.; Jang
// et al. 2017), differentiable by all that the mixture has:
//
//   y = softmax((w + g) / tau),  v = sum_k y_k (m_k + s_k e_k)         (9.4)
//
// w the logits, m_k and s_k means and deviations, g and e the noise. All draws
// at once: each operation is on arrays with a row for each. Keeps its memory.
class SoftDraws {
 public:
  void Draw(const GaussianMixture& mixture, const MixtureNoise& noise,
            double tau);

  int count() const { return static_cast<int>(v_.rows()); }
  const Eigen::ArrayXXd& v() const { return v_; }  // D x n

  // With a = dJ/dv of each draw, D x n,
  //
  //   dJ/dm_k = y_k a,  dJ/d log s_k = y_k s_k e_k a,
  //   dJ/dw_k = y_k a . (m_k + s_k e_k - v) / tau                       (9.8)
  //
  // summed over the draws, in the order of GaussianMixture::Pack().
  Eigen::VectorXd Gradient(const Eigen::ArrayXXd& a) const;

 private:
  double tau_ = 1.0;
  Eigen::ArrayXXd means_;  // K x n
  Eigen::ArrayXXd y_;      // D x K
  Eigen::ArrayXXd off_;    // D x K n: s_k e_k
  Eigen::ArrayXXd v_;      // D x n
};

// A mixture over the parameters' values, in their units: weights K, means and
// standard deviations K x n.
struct ParameterMixture {
  Eigen::VectorXd weights;
  Eigen::MatrixXd means, stds;

  // The weighted sum of the kernels' means: what the mixture estimates.
  Eigen::VectorXd Mean() const;
  // Standard deviations of all kernels together.
  Eigen::VectorXd Std() const;
};

// Moments of each kernel of a mixture over v when carried to the parameters:
// of theta = T(v) by quadrature, exact to rounding for the deviations that
// occur; entries of an inertia that theta holds by (4.1) to first order.
ParameterMixture InParameters(const ShootingProblem& problem,
                              const Transformation& transformation,
                              const GaussianMixture& mixture);

}  // namespace sysid
