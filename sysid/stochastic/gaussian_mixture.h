#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "models/math/types.h"
#include "models/scalars.h"

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

// The random numbers of one reparameterised draw.
struct MixtureDraw {
  Eigen::VectorXd gumbel;  // K, standard Gumbel
  Eigen::MatrixXd normal;  // K x n, standard normal
};
MixtureDraw DrawNoise(int kernels, int dimension, std::mt19937_64* random);

// The draw by Gumbel-Softmax at temperature tau (equation 2 of Heiden et al.;
// Jang et al. 2017), differentiable by all that the mixture has:
//
//   y = softmax((logits + gumbel) / tau)
//   v = sum_k y_k (mean_k + deviation_k normal_k)                      (9.4)
//
// Arrays as in Pack(); v has n numbers.
template <typename T>
void SoftDraw(int kernels, int n, const T* logits, const T* means,
              const T* log_deviations, const MixtureDraw& draw, double tau,
              T* v) {
  using std::exp;
  // Less the largest exponent, a constant that drops out of softmax.
  double most = -1e300;
  for (int k = 0; k < kernels; ++k) {
    most = std::max(most, ValueOf(logits[k]) + draw.gumbel[k]);
  }
  std::vector<T> y(kernels);
  T sum(0.0);
  for (int k = 0; k < kernels; ++k) {
    y[k] = exp((logits[k] + (draw.gumbel[k] - most)) / tau);
    sum += y[k];
  }
  for (int i = 0; i < n; ++i) v[i] = T(0.0);
  for (int k = 0; k < kernels; ++k) {
    const T weight = y[k] / sum;
    for (int i = 0; i < n; ++i) {
      const int at = k * n + i;
      v[i] +=
          weight * (means[at] + exp(log_deviations[at]) * draw.normal(k, i));
    }
  }
}

}  // namespace sysid
