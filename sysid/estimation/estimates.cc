#include "sysid/estimation/estimates.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "models/error.h"
#include "models/math/constants.h"
#include "sysid/estimation/identifiability.h"

namespace sysid {
namespace {

bool AtBound(double value, double bound, double scale) {
  return std::isfinite(bound) && std::abs(value - bound) <= 1e-6 * scale;
}

// What the data says of the parameters that no bound holds, as if the others
// were fixed where they are.
Identifiability AnalyseLoose(const RowMatrixXd& R, const Eigen::VectorXd& scale,
                             const std::vector<bool>& held) {
  const int n = static_cast<int>(R.cols());
  std::vector<int> loose;
  for (int i = 0; i < n; ++i) {
    if (!held[i]) loose.push_back(i);
  }
  const Identifiability part =
      AnalyseIdentifiability(R(Eigen::all, loose), scale(loose));
  Identifiability all;
  all.identifiable.assign(n, true);
  all.covariance.setZero(n, n);
  all.covariance(loose, loose) = part.covariance;
  for (size_t k = 0; k < loose.size(); ++k) {
    all.identifiable[loose[k]] = part.identifiable[k];
  }
  for (const std::vector<int>& group : part.groups) {
    all.groups.emplace_back();
    for (const int k : group) all.groups.back().push_back(loose[k]);
  }
  for (const int k : part.without_influence) {
    all.without_influence.push_back(loose[k]);
  }
  all.undetermined.setZero(n, part.undetermined.cols());
  all.undetermined(loose, Eigen::all) = part.undetermined;
  return all;
}

}  // namespace

Eigen::VectorXd ThetaScale(const ShootingProblem& problem,
                           const Eigen::VectorXd& theta) {
  Eigen::VectorXd scale(theta.size());
  for (int i = 0; i < theta.size(); ++i) {
    scale[i] = problem.map().IsTransformed(i)
                   ? 1.0
                   : std::max(std::abs(theta[i]),
                              problem.free()[i].parameter.typical_scale);
  }
  return scale;
}

std::string NotIdentifiable(const std::vector<std::string>& group) {
  return Join(group) +
         (group.size() == 1 ? " is not identifiable"
                            : " are not separately identifiable") +
         " from this data";
}

bool HeldByBounds(const FreeParameter& free, double value) {
  const double scale = std::max(std::abs(value), free.parameter.typical_scale);
  return AtBound(value, free.lower, scale) || AtBound(value, free.upper, scale);
}

ParameterEstimate MakeEstimate(const FreeParameter& free, double value,
                               double std_error, bool identifiable) {
  ParameterEstimate estimate;
  estimate.name = free.parameter.name;
  estimate.unit = free.parameter.unit;
  estimate.initial = free.initial;
  estimate.value = value;
  estimate.lower = free.lower;
  estimate.upper = free.upper;
  estimate.at_bound = HeldByBounds(free, value);
  estimate.identifiable = identifiable;
  estimate.std_error =
      identifiable && std::isfinite(std_error) ? std_error : kNaN;
  estimate.ci95[0] = value - 1.959964 * estimate.std_error;
  estimate.ci95[1] = value + 1.959964 * estimate.std_error;
  return estimate;
}

Estimates MakeEstimates(const ShootingProblem& problem,
                        const Eigen::VectorXd& theta, const RowMatrixXd& R,
                        const Eigen::MatrixXd& score_covariance) {
  Estimates estimates;
  const int n = problem.map().size();
  Eigen::VectorXd values(n);
  problem.map().ValuesOf<double>(theta.data(), values.data());
  const Eigen::VectorXd scale = ThetaScale(problem, theta);
  std::vector<bool> held(n);
  for (int i = 0; i < n; ++i) {
    // A bound on a transformed parameter is no bound of theta.
    held[i] = !problem.map().IsTransformed(i) &&
              HeldByBounds(problem.free()[i], values[i]);
  }
  const Identifiability known = AnalyseLoose(R, scale, held);
  const Eigen::MatrixXd D = problem.map().ValueJacobian(theta);
  const Eigen::MatrixXd blur = D * known.undetermined;
  const Eigen::MatrixXd moved = D * known.covariance;
  estimates.covariance = moved * score_covariance * moved.transpose();
  estimates.theta_covariance =
      known.covariance * score_covariance * known.covariance;
  // Longer than of white noise by as much as the score is wider along them.
  const Eigen::VectorXd widening =
      (known.undetermined.transpose() * score_covariance * known.undetermined)
          .diagonal()
          .cwiseMax(1.0)
          .cwiseSqrt();
  estimates.undetermined = blur * widening.asDiagonal();
  for (int i = 0; i < n; ++i) {
    const FreeParameter& free = problem.free()[i];
    bool identifiable = known.identifiable[i];
    if (problem.map().IsTransformed(i)) {
      // An inertia's entry is not theta's: what counts is how far the
      // undetermined directions move it, beside a moment's own size (it is
      // positive, and may have run to nearly nothing), or a typical one of a
      // product of inertia.
      const bool moment = free.parameter.component < 3;
      const double size =
          moment ? std::abs(values[i])
                 : std::max(std::abs(values[i]), free.parameter.typical_scale);
      identifiable = blur.row(i).norm() <= kUndetermined * size;
    }
    const double sigma = std::sqrt(estimates.covariance(i, i));
    estimates.parameters.push_back(
        MakeEstimate(free, values[i], held[i] ? kNaN : sigma, identifiable));
  }
  std::set<std::string> grouped;
  for (const std::vector<int>& group : known.groups) {
    std::vector<std::string> names;
    for (const int i : group) {
      // theta_i is named after a moment, but moves others too.
      if (estimates.parameters[i].identifiable) continue;
      names.push_back(estimates.parameters[i].name);
      grouped.insert(names.back());
    }
    // With one theta of an inertia go all the entries that it leaves open.
    for (int i = 0; i < n; ++i) {
      const ParameterEstimate& other = estimates.parameters[i];
      if (!problem.map().IsTransformed(i) || other.identifiable) continue;
      const bool same_link =
          std::any_of(group.begin(), group.end(), [&](int k) {
            return problem.map().IsTransformed(k) &&
                   problem.free()[k].parameter.index ==
                       problem.free()[i].parameter.index;
          });
      if (same_link && grouped.insert(other.name).second) {
        names.push_back(other.name);
      }
    }
    if (!names.empty()) estimates.not_identifiable.push_back(names);
  }
  return estimates;
}

}  // namespace sysid
