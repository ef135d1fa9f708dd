#include "sysid/stochastic/gaussian_mixture.h"

#include <cmath>
#include <limits>

#include "glog/logging.h"
#include "models/math/decompositions.h"

namespace sysid {
namespace {

void Append(const Eigen::MatrixXd& rows, Eigen::VectorXd* packed, int* at) {
  for (int k = 0; k < rows.rows(); ++k) {
    packed->segment(*at, rows.cols()) = rows.row(k);
    *at += static_cast<int>(rows.cols());
  }
}

void Take(const Eigen::VectorXd& packed, int* at, Eigen::MatrixXd* rows) {
  for (int k = 0; k < rows->rows(); ++k) {
    rows->row(k) = packed.segment(*at, rows->cols());
    *at += static_cast<int>(rows->cols());
  }
}

// Nodes and weights of Gauss' quadrature for the standard normal (Golub and
// Welsch 1969: eigenvalues of the Jacobi matrix of Hermite's polynomials).
struct Quadrature {
  static constexpr int kNodes = 15;
  Eigen::VectorXd nodes, weights;

  Quadrature() {
    Eigen::VectorXd beside(kNodes - 1);
    for (int k = 1; k < kNodes; ++k) beside[k - 1] = std::sqrt(k);
    const SymmetricEigen eigen =
        EigenOfTridiagonal(Eigen::VectorXd::Zero(kNodes), beside);
    nodes = eigen.values;
    weights = eigen.vectors.row(0).array().square();
  }
};

}  // namespace

Eigen::VectorXd GaussianMixture::Weights() const {
  const Eigen::ArrayXd e = (logits.array() - logits.maxCoeff()).exp();
  return e / e.sum();
}

Eigen::MatrixXd GaussianMixture::Deviations() const {
  return log_deviations.array().exp();
}

Eigen::VectorXd GaussianMixture::Mean() const {
  return means.transpose() * Weights();
}

Eigen::MatrixXd GaussianMixture::Covariance() const {
  const Eigen::VectorXd weights = Weights(), mean = Mean();
  const Eigen::MatrixXd deviations = Deviations();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(dimension(), dimension());
  for (int k = 0; k < kernels(); ++k) {
    const Eigen::VectorXd off = means.row(k).transpose() - mean;
    covariance += weights[k] * off * off.transpose();
    covariance.diagonal() +=
        weights[k] * deviations.row(k).array().square().matrix();
  }
  return covariance;
}

Eigen::VectorXd GaussianMixture::Pack() const {
  Eigen::VectorXd packed(logits.size() + means.size() + log_deviations.size());
  packed.head(kernels()) = logits;
  int at = kernels();
  Append(means, &packed, &at);
  Append(log_deviations, &packed, &at);
  return packed;
}

void GaussianMixture::Unpack(const Eigen::VectorXd& packed) {
  CHECK_EQ(packed.size(), logits.size() + means.size() + log_deviations.size());
  logits = packed.head(kernels());
  int at = kernels();
  Take(packed, &at, &means);
  Take(packed, &at, &log_deviations);
}

Eigen::VectorXd GaussianMixture::Sample(std::mt19937_64* random) const {
  const Eigen::VectorXd weights = Weights();
  double left = std::uniform_real_distribution<double>(0.0, 1.0)(*random);
  int k = 0;
  while (k + 1 < kernels() && left > weights[k]) left -= weights[k++];
  std::normal_distribution<double> normal;
  Eigen::VectorXd v = means.row(k);
  for (int i = 0; i < dimension(); ++i) {
    v[i] += std::exp(log_deviations(k, i)) * normal(*random);
  }
  return v;
}

GaussianMixture StartingMixture(int kernels, int dimension, double spread,
                                std::mt19937_64* random) {
  std::normal_distribution<double> normal(0.0, spread);
  GaussianMixture mixture;
  mixture.logits = Eigen::VectorXd::Zero(kernels);
  mixture.means.resize(kernels, dimension);
  for (int k = 0; k < kernels; ++k) {
    for (int i = 0; i < dimension; ++i) mixture.means(k, i) = normal(*random);
  }
  mixture.log_deviations =
      Eigen::MatrixXd::Constant(kernels, dimension, std::log(spread));
  return mixture;
}

void DrawNoise(int draws, int kernels, int dimension, std::mt19937_64* random,
               MixtureNoise* noise) {
  noise->gumbel.resize(draws, kernels);
  noise->normal.resize(draws, kernels * dimension);
  std::uniform_real_distribution<double> uniform(
      std::numeric_limits<double>::min(), 1.0);
  for (int d = 0; d < draws; ++d) {
    std::normal_distribution<double> normal;
    for (int k = 0; k < kernels; ++k) {
      noise->gumbel(d, k) = uniform(*random);
      for (int i = 0; i < dimension; ++i) {
        noise->normal(d, k * dimension + i) = normal(*random);
      }
    }
  }
  noise->gumbel = -(-noise->gumbel.log()).log();
}

void SoftDraws::Draw(const GaussianMixture& mixture, const MixtureNoise& noise,
                     double tau) {
  const int K = mixture.kernels(), n = mixture.dimension();
  tau_ = tau;
  means_ = mixture.means;
  y_ = noise.gumbel.rowwise() + mixture.logits.transpose().array();
  // Less the largest exponent, a constant that drops out of softmax.
  y_.colwise() -= y_.rowwise().maxCoeff().eval();
  y_ = (y_ / tau).exp();
  y_.colwise() /= y_.rowwise().sum().eval();
  off_.resize(noise.normal.rows(), K * n);
  v_.setZero(noise.normal.rows(), n);
  for (int k = 0; k < K; ++k) {
    for (int i = 0; i < n; ++i) {
      const int at = k * n + i;
      off_.col(at) =
          std::exp(mixture.log_deviations(k, i)) * noise.normal.col(at);
      v_.col(i) += y_.col(k) * (means_(k, i) + off_.col(at));
    }
  }
}

Eigen::VectorXd SoftDraws::Gradient(const Eigen::ArrayXXd& a) const {
  const int K = static_cast<int>(means_.rows());
  const int n = static_cast<int>(means_.cols());
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(K + 2 * K * n);
  for (int k = 0; k < K; ++k) {
    for (int i = 0; i < n; ++i) {
      const int at = k * n + i;
      const auto y_a = y_.col(k) * a.col(i);
      gradient[k] +=
          (y_a * (means_(k, i) + off_.col(at) - v_.col(i))).sum() / tau_;
      gradient[K + at] = y_a.sum();
      gradient[K + K * n + at] = (y_a * off_.col(at)).sum();
    }
  }
  return gradient;
}

Eigen::VectorXd ParameterMixture::Mean() const {
  return means.transpose() * weights;
}

Eigen::VectorXd ParameterMixture::Std() const {
  const Eigen::VectorXd mean = Mean();
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(mean.size());
  for (int k = 0; k < weights.size(); ++k) {
    const Eigen::VectorXd off = means.row(k).transpose() - mean;
    variance += weights[k] * (off.array().square() +
                              stds.row(k).transpose().array().square())
                                 .matrix();
  }
  return variance.cwiseSqrt();
}

ParameterMixture InParameters(const ShootingProblem& problem,
                              const Transformation& transformation,
                              const GaussianMixture& mixture) {
  static const Quadrature quadrature;
  const int K = mixture.kernels(), n = mixture.dimension();
  const Eigen::MatrixXd deviations = mixture.Deviations();
  ParameterMixture out;
  out.weights = mixture.Weights();
  out.means.resize(K, n);
  out.stds.resize(K, n);
  for (int k = 0; k < K; ++k) {
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(n), square = mean;
    for (int j = 0; j < Quadrature::kNodes; ++j) {
      const Eigen::VectorXd v =
          (mixture.means.row(k) + quadrature.nodes[j] * deviations.row(k));
      const Eigen::VectorXd theta = transformation.Theta(v);
      mean += quadrature.weights[j] * theta;
      square += quadrature.weights[j] * theta.cwiseAbs2();
    }
    const Eigen::VectorXd variance = (square - mean.cwiseAbs2()).cwiseMax(0.0);
    problem.map().ValuesOf<double>(mean.data(), mean.data());
    const Eigen::MatrixXd D =
        problem.map().ValueJacobian(transformation.Theta(mixture.means.row(k)));
    out.means.row(k) = mean;
    out.stds.row(k) = (D.cwiseAbs2() * variance).cwiseSqrt();
  }
  return out;
}

}  // namespace sysid
