#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <limits>

namespace sysid {

// Tolerances from conditioning (conventions, move 13). Two solutions of
// M x = tau - bias, whatever the algorithms, differ by what the rounding of M
// and of the right-hand side becomes on the way through M^-1:
//
//   |dx| <= eps |M^-1| (|M| |x| + |tau| + |bias|),
//
// which is cond(M) eps |x| but where the efforts nearly balance: there x is a
// small difference of large numbers, and no algorithm knows it to eps.
class Conditioning {
 public:
  Conditioning(const Eigen::MatrixXd& M, const Eigen::VectorXd& tau,
               const Eigen::VectorXd& bias)
      : efforts_(tau.norm() + bias.norm()) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
        M, Eigen::EigenvaluesOnly);
    norm_ = eigen.eigenvalues().maxCoeff();
    inverse_norm_ = 1.0 / eigen.eigenvalues().minCoeff();
  }

  double condition() const { return norm_ * inverse_norm_; }

  // |x - y| in units of the bound above; the tests' tolerance is kTolerance,
  // which the project's conventions set (the worst of random chains was 0.9).
  double Units(const Eigen::VectorXd& x, const Eigen::VectorXd& y) const {
    return (x - y).norm() / (std::numeric_limits<double>::epsilon() *
                             inverse_norm_ * (norm_ * y.norm() + efforts_));
  }
  static constexpr double kTolerance = 8.0;

 private:
  double efforts_;
  double norm_;
  double inverse_norm_;
};

}  // namespace sysid
