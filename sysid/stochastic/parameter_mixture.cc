#include "sysid/stochastic/parameter_mixture.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace sysid {
namespace {

// Nodes and weights of Gauss' quadrature for the standard normal (Golub and
// Welsch 1969: eigenvalues of the Jacobi matrix of Hermite's polynomials).
struct Quadrature {
  static constexpr int kNodes = 15;
  Eigen::VectorXd nodes, weights;

  Quadrature() {
    Eigen::VectorXd beside(kNodes - 1);
    for (int k = 1; k < kNodes; ++k) beside[k - 1] = std::sqrt(k);
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
    solver.computeFromTridiagonal(Eigen::VectorXd::Zero(kNodes), beside);
    nodes = solver.eigenvalues();
    weights = solver.eigenvectors().row(0).array().square();
  }
};

}  // namespace

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
