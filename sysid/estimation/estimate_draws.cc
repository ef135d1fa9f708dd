#include "sysid/estimation/estimate_draws.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "models/math/decompositions.h"

namespace sysid {
namespace {

// The covariance without directions that are as good as undetermined: inverse
// dynamics tell by rank, and may call a mass known to a thousand times its
// size.
Eigen::MatrixXd Determined(const Estimates& estimates,
                           const Eigen::VectorXd& scale) {
  constexpr double kWidest = 1.0;
  constexpr double kTakesPart = 0.1;  // as in AnalyseIdentifiability
  const Eigen::VectorXd inverse = scale.cwiseInverse();
  const SymmetricEigen scaled = EigenOfSymmetric(
      inverse.asDiagonal() * estimates.theta_covariance * inverse.asDiagonal());
  const Eigen::MatrixXd V = scale.asDiagonal() * scaled.vectors;
  Eigen::VectorXd variances = scaled.values.cwiseMax(0.0);
  for (int k = 0; k < scale.size(); ++k) {
    if (!(variances[k] > kWidest * kWidest)) continue;
    const Eigen::VectorXd v = scaled.vectors.col(k);
    const double part = kTakesPart * v.cwiseAbs().maxCoeff();
    for (int i = 0; i < v.size(); ++i) {
      if (std::abs(v[i]) >= part && !estimates.parameters[i].identifiable) {
        variances[k] = 0.0;
      }
    }
  }
  Eigen::MatrixXd C = V * variances.asDiagonal() * V.transpose();
  for (int i = 0; i < scale.size(); ++i) {
    // Rounding would move what is held beyond its bound.
    constexpr double kRounding = 1e-12;
    if (std::sqrt(C(i, i)) > kRounding * scale[i]) continue;
    C.row(i).setZero();
    C.col(i).setZero();
  }
  return C;
}

// S (S^-1 C S^-1)^(1/2) of (6.11).
Eigen::MatrixXd RootOf(const Eigen::MatrixXd& C) {
  const Eigen::VectorXd s = C.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd inverse =
      (s.array() > 0.0).select(s.cwiseInverse(), 0.0);
  const SymmetricEigen correlation =
      EigenOfSymmetric(inverse.asDiagonal() * C * inverse.asDiagonal());
  const Eigen::MatrixXd& V = correlation.vectors;
  return s.asDiagonal() * V *
         correlation.values.cwiseMax(0.0).cwiseSqrt().asDiagonal() *
         V.transpose();
}

class Region {
 public:
  Region(const ShootingProblem& problem, const Eigen::VectorXd& theta)
      : problem_(problem), estimate_(ValuesOf(theta)) {}

  Eigen::VectorXd ValuesOf(const Eigen::VectorXd& theta) const {
    Eigen::VectorXd values(theta.size());
    problem_.map().ValuesOf<double>(theta.data(), values.data());
    return values;
  }

  // What keeps a draw from being a model, else "".
  std::string Fault(const Eigen::VectorXd& theta,
                    const Eigen::VectorXd& values) const {
    for (int i = 0; i < values.size(); ++i) {
      const FreeParameter& free = problem_.free()[i];
      // An estimate may be beyond its bound by rounding.
      if (!std::isfinite(values[i]) ||
          values[i] < std::min(free.lower, estimate_[i]) ||
          values[i] > std::max(free.upper, estimate_[i])) {
        return free.parameter.name;
      }
    }
    return problem_.map().FirstImpossibleLink(theta.data());
  }

 private:
  const ShootingProblem& problem_;
  Eigen::VectorXd estimate_;
};

std::string TooFew(const std::map<std::string, std::int64_t>& faults, int found,
                   std::int64_t tries) {
  const auto most = std::max_element(
      faults.begin(), faults.end(),
      [](const auto& a, const auto& b) { return a.second < b.second; });
  return "of " + std::to_string(tries) + " draws " +
         (found == 0 ? std::string("none is")
                     : "only " + std::to_string(found) +
                           (found == 1 ? " is" : " are")) +
         " within all bounds; most often " + most->first +
         " is beyond its own: fix it, or give it other bounds";
}

}  // namespace

EstimateDraws DrawFromEstimate(const ShootingProblem& problem,
                               const Eigen::VectorXd& theta,
                               const Estimates& estimates, int count,
                               std::uint64_t seed) {
  // With a dozen parameters at bounds one draw of 4096 is within them.
  constexpr std::int64_t kLeastTries = 10000, kTriesOfADraw = 1000;
  EstimateDraws draws;
  const Eigen::MatrixXd C =
      estimates.theta_covariance.allFinite()
          ? Determined(estimates, ThetaScale(problem, theta))
          : Eigen::MatrixXd::Zero(theta.size(), theta.size());
  if (!(C.diagonal().array() > 0.0).any()) {
    draws.failure =
        "no free parameter has a variance: the data identify none of them, or "
        "each is at a bound";
    return draws;
  }
  const Region region(problem, theta);
  const Eigen::MatrixXd root = RootOf(C);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::map<std::string, std::int64_t> faults;
  const std::int64_t most = kLeastTries + kTriesOfADraw * count;
  Eigen::VectorXd z(theta.size());
  draws.values.resize(count, theta.size());
  int found = 0;
  for (std::int64_t tries = 0; found < count; ++tries) {
    if (tries == most) {
      draws.failure = TooFew(faults, found, tries);
      break;
    }
    for (double& component : z) component = normal(random);
    const Eigen::VectorXd drawn = theta + root * z;
    const Eigen::VectorXd values = region.ValuesOf(drawn);
    const std::string fault = region.Fault(drawn, values);
    if (fault.empty()) {
      draws.values.row(found++) = values;
    } else {
      ++faults[fault];
    }
  }
  return draws;
}

}  // namespace sysid
